"""One call that plays a scenario and writes it as a data set, whole or not at all.

Its capture is photos of the room as a phone takes them, with poses and masks.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenes.cameras import Fisheye, Pinhole, Rig
from scenes.formats.storage.atomic import WriteError, write_folder
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.dataset.bop import BopOptions, write_bop
from sim.dataset.check import Checked, check_dataset
from sim.dataset.json_stream import JsonList, matrix, write_json
from sim.dataset.pictures import write_labels
from sim.dataset.room_folder import (
    FolderOptions,
    Pictures,
    labels_of,
    seen_to_json,
    write_room,
    write_sequences,
)
from sim.dataset.truth.lens_truth import LensTruthPass
from sim.dataset.truth.pinhole_views import PinholeView, ViewSampler
from sim.dataset.truth.visibility import OUTSIDE, seen
from sim.phone.capture import TRUTH, Capture
from sim.phone.phone import SAMPLE_CAPTURE, PhoneOptions, film
from sim.reality.scanned import Scanned
from sim.rehearsal import SimulatedStep, simulate
from sim.scenarios.scenario import Scenario, validate_scenario

Form = Literal["room-c", "bop"]

PHOTO_STREAM = 0x70686F746F
"""Second word of the photos' random stream ("photo"), so that it is none of the rehearsal's."""

Progress = Callable[[float, str], None]

FINER = 1.5
"""Pixels of the fisheye from which a photo's masks are taken, per pixel of the photo."""

MARGIN_RAD = 0.02
"""Of the fisheye around a photo's corners, radians."""


@dataclass(frozen=True, slots=True)
class DatasetOptions:
    """Form and extent of a data set.

    Attributes:
        form: "room-c" (docs/datasets.md) or "bop".
        every: of so many frames, one is written, at least 1.
        pictures: "png", "jpg", or "video" (form room-c only).
        view_px: side of BOP's views; None for as fine as the lens.
        photos: how the room is photographed for form room-c; None for no photos.

    Raises:
        ValueError: `every` is below 1, or a video is asked for in BOP's form.
    """

    form: Form = "room-c"
    every: int = 1
    pictures: Pictures = "png"
    view_px: int | None = None
    photos: PhoneOptions | None = field(default=SAMPLE_CAPTURE)

    def __post_init__(self) -> None:
        if self.every < 1:
            raise ValueError(f"data set: every {self.every} frames, wanted at least 1")
        if self.form == "bop" and self.pictures == "video":
            raise ValueError("data set: BOP's form has no video; choose png or jpg")
        if self.view_px is not None and self.view_px < 16:
            raise ValueError(f"data set: views of {self.view_px} px, wanted at least 16")


@dataclass(frozen=True, slots=True)
class Written:
    """Contents of a folder that was written.

    Attributes:
        frames: of the sequence.
        photos: of the capture; 0 for none.
        checked: what a reader found.
    """

    frames: int
    photos: int
    checked: Checked


def write_dataset(
    folder: Path,
    room: PhysicalRoom,
    scenario: Scenario,
    *,
    seed: int,
    options: DatasetOptions = DatasetOptions(),
    scanned: Scanned | None = None,
    progress: Progress = lambda done, note: None,
) -> Written:
    """Play a scenario into a new folder, and read it back.

    Memory holds a frame, whatever the length. The same seed gives the same bytes.

    Args:
        folder: must not exist, or be empty.
        room: the physical room.
        scenario: what happens.
        seed: decides everything random.
        options: see `DatasetOptions`.
        scanned: needed for a room that is made of splats; its world is then the data set's, and no
            error of it is drawn.
        progress: called with the share done and a note.

    Raises:
        ScenarioError: the scenario doesn't fit the room.
        ValueError: the folder is not empty, there is no object, or what was written is wrong.
        WriteError: the disk is full; the folder is as it was.
    """
    validate_scenario(scenario, room)
    if not room.objects:
        raise ValueError(f"{room.name}: no movable object, so there is no pose to write; cut one")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise WriteError(f"{folder}: already holds something; choose a new folder")
    counts: list[int] = []
    checked: list[Checked] = []

    def fill(part: Path) -> None:
        steps = _played(room, scenario, seed, scanned)
        photos = 0
        if options.form == "bop":
            bop = BopOptions(options.every, _still(options.pictures), options.view_px)
            written = write_bop(part, room, scenario, steps, options=bop)
        else:
            write_room(part, room)
            if options.photos is not None and room.static:
                rng = np.random.default_rng([seed, PHOTO_STREAM])
                photos = write_capture(
                    part / "capture", room, rng=rng, options=options.photos, progress=progress
                )
            plan = FolderOptions(options.every, options.pictures)
            written = write_sequences(part, room, scenario, steps, options=plan)
        counts.extend((_counted(written, steps, scenario, options.every, progress), photos))
        checked.append(check_dataset(part))
        checked[0].require(folder)

    write_folder(folder, fill, replace=True)
    return Written(counts[0], counts[1], checked[0])


def _still(pictures: Pictures) -> Literal["png", "jpg"]:
    return "jpg" if pictures == "jpg" else "png"


def _played(
    room: PhysicalRoom, scenario: Scenario, seed: int, scanned: Scanned | None
) -> Generator[SimulatedStep, None, None]:
    if scanned is not None:
        scanned = replace(scanned, error=None)
    yield from simulate(room, scenario, seed=seed, scanned=scanned)


def _counted(
    written: Iterator[int],
    steps: Generator[SimulatedStep, None, None],
    scenario: Scenario,
    every: int,
    progress: Progress,
) -> int:
    """Run the writer to its end; the simulation ends with it, whatever happens."""
    total = max(1, int(scenario.duration_s * scenario.camera.fps) // every)
    count = 0
    with closing(steps):
        for count in written:
            progress(min(1.0, count / total), f"frame {count} of {total}")
    if not count:
        raise ValueError(f"{scenario.name}: no frame arrived, so there is nothing to write")
    return count


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
