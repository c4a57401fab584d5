"""One call that plays a scenario and writes it as a data set, whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from scenes.formats.storage.atomic import WriteError, write_folder
from scenes.mesh import PhysicalRoom
from sim.dataset.bop import BopOptions, write_bop
from sim.dataset.check import Checked, check_dataset
from sim.dataset.photos import write_capture
from sim.dataset.room_folder import FolderOptions, Pictures, write_room, write_sequences
from sim.phone.phone import SAMPLE_CAPTURE, PhoneOptions
from sim.reality.scanned import Scanned
from sim.rehearsal import SimulatedStep, simulate
from sim.scenarios.scenario import Scenario, validate_scenario

Form = Literal["room-c", "bop"]

PHOTO_STREAM = 0x70686F746F
"""Second word of the photos' random stream ("photo"), so that it is none of the rehearsal's."""

Progress = Callable[[float, str], None]


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
