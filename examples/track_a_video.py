"""Track a scene's objects in a 360° video and mark them in its last picture.

    ./nexus rehearse --scenario lab-short --headless --out out/demo
    .venv/bin/python examples/track_a_video.py lab out/demo/recording.mcap --out tracked.png

The video is a recording, or any footage with `--camera CAMERA.json` (docs/tracking.md). The tracker
is a pure step: state and frame in, next state and poses out. It is given no truth, and the camera's
pose only as a marker would measure it.
"""

import argparse
import math
from pathlib import Path

import cv2
import numpy as np

from devices.footage import read_camera, read_footage
from devices.replay import ReplayCamera
from scenes.opening import open_scene
from scenes.render.native import NativeRenderer
from tracking.tracker import Tracker


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("video", type=Path)
    parser.add_argument("--camera", type=Path, help="of footage that is no recording")
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    args = parser.parse_args()

    scene = open_scene(args.scene)
    if args.camera is None:
        frames = ReplayCamera(args.video).frames()
    else:
        frames = read_footage(args.video, read_camera(args.camera))
    tracker = Tracker(scene.room, scene.objects, NativeRenderer())
    state, frame, output = tracker.start(), None, None
    for frame in frames:
        state, output = tracker.step(state, frame, frame.received_ns)
    if frame is None or output is None or output.world_from_rig is None:
        raise SystemExit(f"{args.video}: not a single picture in it")

    lens = frame.rig.lenses[0]
    lens_from_world = (output.world_from_rig @ frame.rig.rig_from_lens[0]).inverse()
    picture = np.ascontiguousarray(frame.images[0][..., ::-1])
    for track in output.objects:
        pose, size_m = track.world_from_object, scene.object_by_id(track.object_id).box_m
        x, y, z = pose.translation
        sigma_cm = 100 * math.sqrt(track.covariance[0, 0] + track.covariance[1, 1])
        where = (
            f"({x:.2f}, {y:.2f}, {z:.2f}) m ± {sigma_cm:.1f} cm, {math.degrees(pose.yaw()):.0f}°"
        )
        print(f"{track.object_id:10} {track.state:9} {where}")
        unit = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (0.0, 1.0)])
        pixels, seen = lens.project(lens_from_world @ (pose @ (unit * size_m)))
        for k, other in [(k, k | bit) for k in range(8) for bit in (1, 2, 4) if not k & bit]:
            if seen[k] and seen[other]:
                start, end = (tuple(int(v) for v in pixels[corner]) for corner in (k, other))
                cv2.line(picture, start, end, (64, 255, 64), 1, cv2.LINE_AA)
    cv2.imwrite(str(args.out), picture)


if __name__ == "__main__":
    main()
