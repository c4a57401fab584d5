"""A random room as its owner prepares it: codes hung, filmed by the phone, made a scene package.

A finished capture is a folder that is kept: the photos, the phone's truth, the scene package and
the stages it was made in.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.evaluate.cuts.printed_codes import with_codes
from benchmarks.evaluate.dataset.layout import Dataset
from benchmarks.random_rooms.room import random_room
from scenes.formats.storage.atomic import write_file
from scenes.mesh import PhysicalRoom
from scenes.package import is_package
from scenes.pose import Pose
from scenes.prepare.options import PrepareOptions
from scenes.prepare.pipeline import prepare
from scenes.prepare.reconstruction import View, load_reconstruction, save_reconstruction
from scenes.prepare.stages import open_work_folder
from scenes.quad import QrCode
from scenes.render.native import NativeRenderer
from sim.phone.capture import IMAGES, TRUTH, read_truth
from sim.phone.phone import film
from studio.console.progress import Progress, StageProgress

SCENE, PHOTOS, NOTES = "scan.gnx", "photos", "capture.json"
"""Of a capture's folder: the scene package, the photos with their poses in its world, and how it
came about."""

POSES = "poses/sfm/reconstruction"
"""Of a preparation's folder: the photos' places as structure from motion found them."""

WRONG_TURN_DEG = 5.0
"""Photos at right places are turned by tenths of a degree, mistaken ones by many."""

TRUE_POSES = TRUTH / "transforms.json"
"""Of a capture's folder: the phone's poses in the form that `nexus prepare --poses` reads."""


@dataclass(frozen=True, slots=True)
class Notes:
    """How a capture came about.

    Attributes:
        name: of the room.
        placed: share of the photos that structure from motion placed; 0 where it gave up.
        refused: why it, or the codes, gave no room; empty if they did. Then the scene was made with
            the phone's true poses.
        psnr_db: of views that training never saw.
        minutes: that the preparation took.
    """

    name: str
    placed: float
    refused: str
    psnr_db: float
    minutes: float


def filmed_movables(seed: int) -> tuple[PhysicalRoom, dict[str, str]]:
    """The room of a seed as it was filmed, with codes on its walls, and its objects' families."""
    room = random_room(seed)
    families = {name: item.family for name, item in room.movables.items()}
    return with_codes(room.scanned), families


def capture_room(
    seed: int, folder: Path, *, progress: Progress, clock: Callable[[], float]
) -> Notes:
    """Film and prepare a random room, unless that is there already.

    Args:
        seed: of the room; decides everything random.
        folder: of the capture; what is finished in it is kept.
        progress: shows what is under way.
        clock: seconds, for the durations.

    Raises:
        ValueError: the room has no wall for a code or no floor to walk on, or its photos become no
            room even at their true poses.
    """
    kept = _kept(folder)
    if kept is not None:
        return kept
    room, _ = filmed_movables(seed)
    if not (folder / TRUE_POSES).is_file():
        progress.begin(f"filming {room.name}")
        shown = progress.advance
        truth = film(room, folder, rng=np.random.default_rng(seed), progress=shown)
        progress.finish(f"{len(truth.shots)} photos")
    by_codes = _by_codes(room.codes, seed)
    without_codes = PrepareOptions(poses=folder / TRUE_POSES, metric_poses=True, seed=seed)
    ways = (by_codes, replace(by_codes, poses=folder / TRUE_POSES), without_codes)
    truth = {shot.name: shot.world_from_camera for shot in read_truth(folder).shots}
    return _prepared(
        folder / IMAGES, folder, ways=ways, shown=_Shown(room.name, progress, clock, truth)
    )


def capture_dataset(
    dataset: Dataset, folder: Path, *, progress: Progress, clock: Callable[[], float]
) -> Notes:
    """Prepare a dataset's photos in its own world, unless that is there; see `capture_room`."""
    kept = _kept(folder)
    if kept is not None:
        return kept
    codes = tuple(
        QrCode(name, dataset.code_side_m, _code_pose(corners))
        for name, corners in dataset.code_corners_m.items()
    )
    ways = (_by_codes(codes, 0),)
    shown = _Shown(dataset.folder.name, progress, clock, dataset.world_from_camera)
    return _prepared(dataset.photos, folder, ways=ways, shown=shown)


@dataclass(frozen=True, slots=True)
class _Shown:
    """A room under preparation: its name, where its progress goes, and where photos truly were."""

    name: str
    progress: Progress
    clock: Callable[[], float]
    truth: Mapping[str, Pose]


def _kept(folder: Path) -> Notes | None:
    """How a finished capture came about; None if it is not finished."""
    notes = folder / NOTES
    if not (notes.is_file() and is_package(folder / SCENE)):
        return None
    return Notes(**json.loads(notes.read_text(encoding="utf-8")))


def _by_codes(codes: tuple[QrCode, ...], seed: int) -> PrepareOptions:
    """The product's defaults; the codes' places make the prepared world the true one."""
    sides = {code.payload: code.side_m for code in codes}
    return PrepareOptions(sides_m=sides, known_codes=codes, seed=seed)


def _prepared(
    images: Path, folder: Path, *, ways: Sequence[PrepareOptions], shown: _Shown
) -> Notes:
    """Prepare photos in the first of some ways that gives a room, and keep the scene.

    Raises:
        ValueError: none does; says why the first did not.
    """
    refused = ""
    for options in ways:
        stages = StageProgress(shown.progress)
        path = folder / f"{SCENE}.prepare"
        watched = _Watched(path / POSES, shown.truth, stages)
        work = open_work_folder(path, seconds=shown.clock, progress=watched)
        try:
            prepared = prepare(
                images, folder / SCENE, work=work, options=options, renderer=NativeRenderer()
            )
        except ValueError as reason:
            refused = refused or str(reason)
            continue
        stages.finish()
        save_reconstruction(prepared.reconstruction, folder / PHOTOS)
        placed = 0.0 if refused else len(prepared.sfm.placed) / len(prepared.capture.frames)
        minutes = sum(stage.seconds or 0.0 for stage in prepared.package.stages) / 60
        notes = Notes(shown.name, placed, refused, prepared.training.psnr_db, minutes)
        write_file(folder / NOTES, [json.dumps(asdict(notes), indent=1).encode()])
        return notes
    raise ValueError(f"{shown.name}: {refused}")


class _Watched:
    """Progress of a preparation that is ended once photos turn out to be at wrong places.

    Splats of wrong poses say nothing about cuts, and a training takes minutes.

    Args:
        folder: of the reconstruction, once there is one.
        truth: where each photo was.
        shown: gets the progress.
    """

    def __init__(self, folder: Path, truth: Mapping[str, Pose], shown: StageProgress) -> None:
        self._folder, self._truth, self._shown = folder, truth, shown
        self._is_checked = False

    def __call__(self, done: float, note: str) -> None:
        """How far the stage is that the note begins with.

        Raises:
            ValueError: photos are at wrong places.
        """
        self._shown(done, note)
        if not self._is_checked and note.startswith("alignment"):
            self._is_checked = True
            if self._folder.is_dir():
                require_right_poses(load_reconstruction(self._folder).views, self._truth)


def require_right_poses(views: Sequence[View], truth: Mapping[str, Pose]) -> None:
    """Check the directions of placed photos, each against all others.

    Raises:
        ValueError: some look elsewhere than they truly did; says how many.
    """
    placed = [view for view in views if view.name in truth]
    turns = Rotation.from_matrix(
        np.stack([truth[view.name].rotation @ view.world_from_camera.rotation.T for view in placed])
    )
    # Most photos are right: the turn that is nearest to most is that between the two worlds.
    apart = np.degrees(np.stack([(turns * turn.inv()).magnitude() for turn in turns]))
    off = apart[int(np.argmin(np.median(apart, axis=1)))]
    wrong = int((off > WRONG_TURN_DEG).sum())
    if wrong:
        raise ValueError(
            f"structure from motion turned {wrong} of {len(placed)} photos by more than "
            f"{WRONG_TURN_DEG:g}°, up to {off.max():.0f}°"
        )


def _code_pose(corners_m: NDArray[np.float64]) -> Pose:
    """Pose of a printed code (x right, y up, z out of the wall) from its corners, clockwise."""
    across, up = corners_m[1] - corners_m[0], corners_m[0] - corners_m[3]
    x, y = across / np.linalg.norm(across), up / np.linalg.norm(up)
    return Pose(np.stack([x, y, np.cross(x, y)], axis=1), corners_m.mean(axis=0))
