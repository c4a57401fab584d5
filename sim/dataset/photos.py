"""The capture of a data set: photos of the room as a phone takes them, with poses and masks."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from scenes.cameras import Fisheye, Pinhole, Rig
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.dataset.json_stream import JsonList, matrix, write_json
from sim.dataset.pictures import write_labels
from sim.dataset.room_folder import labels_of, seen_to_json
from sim.dataset.truth.lens_truth import LensTruthPass
from sim.dataset.truth.pinhole_views import PinholeView, ViewSampler
from sim.dataset.truth.visibility import OUTSIDE, seen
from sim.phone.capture import TRUTH, Capture
from sim.phone.phone import PhoneOptions, film

FINER = 1.5
"""Pixels of the fisheye from which a photo's masks are taken, per pixel of the photo."""

MARGIN_RAD = 0.02
"""Of the fisheye around a photo's corners, radians."""


def write_capture(
    folder: Path,
    room: PhysicalRoom,
    *,
    rng: np.random.Generator,
    options: PhoneOptions,
    progress: Callable[[float, str], None],
) -> int:
    """Film the room into `folder` (`capture/`); returns the number of photos.

    Raises:
        ValueError: the room leaves no place to walk, or the options ask for a video.
        OSError: the disk is full.
    """
    if options.output != "photos":
        raise ValueError(f"capture: output {options.output!r}, wanted photos")
    capture = film(room, folder, rng=rng, options=options, progress=progress)
    shutil.rmtree(folder / TRUTH)
    write_json(folder / "cameras.json", _cameras(capture))
    (folder / "masks").mkdir()
    view = PinholeView(capture.camera, Pose.identity())
    lens = _lens_around(capture.camera)
    sampler = ViewSampler(lens, view)
    rig = Rig((lens,), (Pose.identity(),))
    places = {item.object_id: item.world_from_object for item in room.objects}
    head = {"labels": {"ids": labels_of(room), "scale": 1}}
    with (
        closing(LensTruthPass(room, rig, stand=False, camera_moves=True)) as truth_pass,
        JsonList(folder / "visible.json", head=head, key="frames", keyed=True) as frames,
    ):
        for number, shot in enumerate(capture.shots):
            progress(number / len(capture.shots), f"masks of {shot.name}")
            truth = sampler.truth(truth_pass.frame(shot.world_from_camera, places, {})[0])
            write_labels(folder / "masks" / f"{Path(shot.name).stem}.png", truth.ids)
            entry: dict[str, Any] = {}
            for k, name in enumerate(places, start=1):
                alone = truth.silhouettes.get(name)
                found = OUTSIDE if alone is None else seen(alone, alone & (truth.ids == k), (0, 0))
                entry[name] = seen_to_json(found)
            frames.add(entry, name=f"images/{shot.name}")
    return len(capture.shots)


def _lens_around(camera: Pinhole) -> Fisheye:
    """A fisheye that sees a whole photo, somewhat finer than it."""
    corners = np.array([[0.0, 0.0], [float(camera.width_px), float(camera.height_px)]])
    reach = float(np.arccos(camera.unproject(corners)[:, 2]).max()) + MARGIN_RAD
    # A pinhole's corner is 1 / cos² as fine as its middle.
    f_px = FINER * camera.fx / np.cos(reach - MARGIN_RAD) ** 2
    side = 2 * int(np.ceil(f_px * reach))
    return Fisheye(side, side, float(f_px), side / 2, side / 2, reach)


def _cameras(capture: Capture) -> dict[str, Any]:
    camera = capture.camera
    return {
        "model": "pinhole",
        "width": camera.width_px,
        "height": camera.height_px,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "distortion": [],
        "pixel_centre_of_top_left": [0.5, 0.5],
        "camera_axes": "OpenCV: x right, y down, z forward",
        "frames": [
            {
                "file": f"images/{shot.name}",
                "t_ns": shot.t_ns,
                "world_from_camera": matrix(shot.world_from_camera),
            }
            for shot in capture.shots
        ],
    }
