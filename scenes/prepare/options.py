"""The options of a preparation, and which of them exclude each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.footage.capture import CaptureOptions
from scenes.prepare.poses.sfm.job import SfmOptions
from scenes.prepare.train.trainer import PRESETS
from scenes.quad import QrCode

BUILT_IN = "built-in"
PROGRAMS = ("gsplat", "brush", "opensplat", "inria")
SCRIPTS = ("gsplat", "inria")
"""Programs that are scripts somewhere on the disk: where must be said."""


@dataclass(frozen=True, slots=True)
class KnownLength:
    """A length measured in the room.

    Attributes:
        metres: the length.
        a_px: pixel (x, y) of its one end by photo, in two photos or more.
        b_px: of its other end.
    """

    metres: float
    a_px: Mapping[str, tuple[float, float]]
    b_px: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class KnownObject:
    """An object of known size that stands in the room.

    Attributes:
        points_m: (N, 3) points that span it, in its own frame, Z up: the corners of its box, or
            its surface.
        boxes_px: (left, top, right, bottom) close around it by photo, in two photos or more.
    """

    points_m: NDArray[np.float64]
    boxes_px: Mapping[str, tuple[float, float, float, float]]


@dataclass(frozen=True, slots=True)
class PrepareOptions:
    """How a room is prepared.

    Attributes:
        quality: one of `scenes.prepare.train.trainer.PRESETS`.
        steps: training ends after so many, instead of the quality's own number.
        poses: a COLMAP model or a transforms.json to take the photos' poses from.
        metric_poses: whether those poses are in metres, as augmented-reality apps write them.
        splats: a file that was trained on the photos, in the frame of `poses`, instead of training.
        trainer: `BUILT_IN`, or one of `PROGRAMS`.
        program: where that program is; needed for `SCRIPTS`.
        headset_mesh: a mesh of the room to collide with, instead of one of the splats.
        sides_m: printed side of the codes: one for all, or by payload. None ignores codes.
        known_codes: codes whose poses in the world are known; then that is the room's world.
        known_length: gives the scale where there are no codes.
        known_object: gives it too; without any of these it is guessed.
        per_axis: stretch the axes until every code's sides have their printed length (the paper's
            way), which hides an error of lens or poses.
        capture: how frames are chosen.
        sfm: how they are placed.
        seed: decides everything random.
        collision: whether a collision mesh is made.
        keep_floaters: whether stray splats stay in the room.

    Raises:
        ValueError: two of them contradict each other, or there is no such quality or trainer.
    """

    quality: str = "default"
    steps: int | None = None
    poses: Path | None = None
    metric_poses: bool = False
    splats: Path | None = None
    trainer: str = BUILT_IN
    program: Path | None = None
    headset_mesh: Path | None = None
    sides_m: Mapping[str, float] | float | None = None
    known_codes: tuple[QrCode, ...] = ()
    known_length: KnownLength | None = None
    known_object: KnownObject | None = None
    per_axis: bool = False
    capture: CaptureOptions = field(default_factory=CaptureOptions)
    sfm: SfmOptions = field(default_factory=SfmOptions)
    seed: int = 0
    collision: bool = True
    keep_floaters: bool = False

    def __post_init__(self) -> None:
        if self.quality not in PRESETS:
            raise ValueError(
                f"quality {self.quality!r}: there is none; wanted one of {', '.join(PRESETS)}"
            )
        if self.trainer not in (BUILT_IN, *PROGRAMS):
            raise ValueError(
                f"trainer {self.trainer!r}: there is none; wanted {BUILT_IN}, {', '.join(PROGRAMS)}"
            )
        contradictions = (
            *self._contradictions_of_training(),
            *self._contradictions_of_scale(),
            *self._contradictions_of_pictures(),
        )
        wrong = next((words for is_wrong, words in contradictions if is_wrong), None)
        if wrong is not None:
            raise ValueError(wrong)

    def _contradictions_of_training(self) -> tuple[tuple[bool, str], ...]:
        external = self.trainer != BUILT_IN
        return (
            (
                self.splats is not None and self.poses is None,
                "trained splats need the poses they were trained with: give these too",
            ),
            (
                self.steps is not None and self.steps < 1,
                f"{self.steps} training steps: wanted at least 1",
            ),
            (
                self.splats is not None and self.steps is not None,
                "splats that are trained already, and steps to train: give one of both",
            ),
            (
                self.splats is not None and external,
                "splats that are trained already and a trainer: give one of both",
            ),
            (
                self.trainer in SCRIPTS and self.program is None,
                f"{self.trainer} is a script of its own: say where it is",
            ),
            (
                self.program is not None and not external,
                "a program to train with, and no trainer that it belongs to",
            ),
        )

    def _contradictions_of_scale(self) -> tuple[tuple[bool, str], ...]:
        return (
            (
                self.metric_poses and self.poses is None,
                "poses are said to be in metres, and none are given",
            ),
            (
                self.metric_poses and self.known_length is not None,
                "a length, and poses that are in metres already: give one of both",
            ),
            (
                self.known_length is not None and self.sides_m is not None,
                "a length and the codes' size both give the scale: give one of them",
            ),
            (
                self.known_object is not None
                and (self.known_length is not None or self.sides_m is not None),
                "a known object, and codes or a length: give one of them for the scale",
            ),
            (
                self.metric_poses and self.known_object is not None,
                "a known object, and poses that are in metres already: give one of both",
            ),
            (
                self.per_axis and self.sides_m is None,
                "a scale per axis is measured on codes: give their printed size",
            ),
            (
                bool(self.known_codes) and self.sides_m is None,
                "codes with known places need their printed size too",
            ),
        )

    def _contradictions_of_pictures(self) -> tuple[tuple[bool, str], ...]:
        return (
            (
                self.capture.rig is not None and self.poses is not None,
                "a 360° video's lenses, and poses of other pictures: give one of both",
            ),
            (
                self.headset_mesh is not None and not self.collision,
                "a headset's mesh, and no collision mesh wanted: give one of both",
            ),
        )
