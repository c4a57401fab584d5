"""Write a tracking method of your own and hold it against the truth.

    ./nexus rehearse --scenario lab-short --headless --out out/demo
    .venv/bin/python examples/own_tracker_method.py out/demo/recording.mcap --out errors.png

A method has `start` and `step` (`tracking.output.TrackingMethod`): a pure step over an immutable
state, without clock, files or random numbers. This one draws the empty room once and moves each
object along the floor to the middle of what differs near it. It knows nothing of people or yaw.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

from devices.recording import read_recording
from devices.recording_codec import RecordedTruth
from devices.replay import ReplayCamera
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.state import TrackedObject, TrackState
from tracking.output import TrackOutput
from tracking.tracker import Tracker


class DifferenceMethod:
    """Follows objects by what differs from the empty room."""

    def __init__(self, scene, renderer):
        self._scene, self._renderer = scene, renderer

    def start(self):
        """No picture of the empty room yet; objects where the scan saw them."""
        return None, {item.object_id: item.world_from_object for item in self._scene.objects}

    def step(self, state, frame, now_ns):
        """The next state, and every object's pose in this frame."""
        empty, poses = state
        lens, world_from_lens = frame.rig.lenses[0], frame.world_from_rig
        if empty is None:
            room = [PosedSplats(self._scene.room, Pose.identity())]
            empty = self._renderer.render(room, lens, world_from_lens).rgb
        live = frame.images[0].astype(np.float32) / 255
        changed = np.argwhere(cv2.blur(np.abs(live - empty), (5, 5)).max(axis=2) > 0.2)
        changed_px, eye, tracks = changed[:, ::-1] + 0.5, world_from_lens.translation, []
        for item in self._scene.objects:
            pose, (centre_in_object, radius_m) = poses[item.object_id], item.sphere()
            centre = pose @ centre_in_object
            centre_px, seen = lens.project(world_from_lens.inverse() @ centre)
            reach_px = lens.f_px * radius_m / np.linalg.norm(centre - eye)
            near_px = changed_px[np.linalg.norm(changed_px - centre_px, axis=1) < reach_px]
            if seen[0] and len(near_px) >= 20:
                ray = world_from_lens.rotation @ lens.unproject(near_px.mean(axis=0))[0]
                x, y, _ = eye + ray * (centre - eye)[2] / ray[2]
                pose = Pose(pose.rotation, np.array([x, y, pose.translation[2]]))
            tracks.append(
                TrackedObject(item.object_id, frame.t_ns, pose, 0.01 * np.eye(4), 1.0,
                              TrackState.TRACKED, 0.5, frame.seq)
            )  # fmt: skip
        poses = {track.object_id: track.world_from_object for track in tracks}
        return (empty, poses), TrackOutput(tuple(tracks), {}, frame.world_from_rig)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--object", default="chair-1", help="whose error is shown")
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    args = parser.parse_args()

    camera, values = ReplayCamera(args.recording), read_recording(args.recording)
    true = {v.seq: v.world_from_object[args.object] for v in values if isinstance(v, RecordedTruth)}
    scene, renderer = open_scene(camera.session.scene), NativeRenderer()
    own = Tracker(scene.room, scene.objects, renderer)
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.add_subplot(xlabel="time, s", ylabel=f"error of {args.object}, cm")
    for name, method in {"difference": DifferenceMethod(scene, renderer), "own": own}.items():
        state, error_cm = method.start(), {}
        for frame in camera.frames():
            state, output = method.step(state, frame, frame.received_ns)
            found = next(t for t in output.objects if t.object_id == args.object)
            off_m = found.world_from_object.translation - true[frame.seq].translation
            error_cm[frame.t_ns / 1e9] = 100 * np.linalg.norm(off_m)
        mean_cm = np.mean(list(error_cm.values()))
        print(f"{name:10} {mean_cm:6.1f} cm in the mean of {len(error_cm)} frames")
        axes.plot(list(error_cm), list(error_cm.values()), label=name)
    axes.legend()
    figure.savefig(args.out)


if __name__ == "__main__":
    main()
