"""A tracking method's answers on objects whose true poses are known, judged.

Shared by the datasets and the random rooms, so that their figures mean the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.evaluate.findings import FLIP_DEG
from scenes.state import TrackState
from studio.evaluate.metrics import PoseError

RIGHT_CM, RIGHT_DEG = 5.0, 5.0
"""A pose within both is right: the field's usual 5 cm, 5° (`sequence` of the evaluation, too)."""

MIN_VISIBLE = 0.5
"""A cold start is asked for objects of which at least so much is visible."""

MIN_WIDTH_PX = 24.0
"""And that are at least so wide in the picture."""

FLAGGED = 0.5
"""A wrong pose with a confidence below this, or a lost one, is flagged."""

REST_BAR_CM = 3.0
"""An object at rest that is reported farther from its place was moved by the tracker alone."""

CONFIDENCE_BINS = 10
"""Equal bins of the confidence for its calibration error (Naeini et al. 2015)."""

UNFOUND_CM, UNFOUND_DEG = 500.0, 180.0
"""Errors that stand for an object without an answer: a room's size, and any yaw."""


@dataclass(frozen=True, slots=True)
class Visibility:
    """How much of an object a picture shows.

    Attributes:
        fraction: 0..1, visible pixels over those of the object alone.
        width_px: of the object alone; 0 outside the picture.
    """

    fraction: float
    width_px: float


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A method's report of one object in one picture.

    Attributes:
        session: "room", "room_chained", "sequence", ...
        still: name of the picture.
        object_id: of the room.
        error: of the reported pose, the object's symmetry aside; None where there is none.
        moved_cm: how far the reported pose is from where the object stood in the capture.
        confidence: as reported, 0..1.
        state: as reported; None where there is no answer.
        is_moved: whether it truly stands elsewhere than in the capture.
        seen: what the picture shows of it.
    """

    session: str
    still: str
    object_id: str
    error: PoseError | None
    moved_cm: float
    confidence: float
    state: TrackState | None
    is_moved: bool
    seen: Visibility


def is_right(answer: Answer) -> bool:
    """Whether the reported pose is within 5 cm and 5°, and not called lost."""
    return (
        answer.error is not None
        and answer.state is not TrackState.LOST
        and answer.error.world_cm <= RIGHT_CM
        and answer.error.yaw_deg <= RIGHT_DEG
    )


def is_asked(answer: Answer) -> bool:
    """Whether the picture shows enough of the object to ask for its pose."""
    return answer.seen.fraction >= MIN_VISIBLE and answer.seen.width_px >= MIN_WIDTH_PX


def is_unflagged(answer: Answer) -> bool:
    """Whether the method gave the pose without a doubt of its own."""
    return answer.confidence >= FLAGGED and answer.state is not TrackState.LOST


def calibration_error(answers: Sequence[Answer]) -> float:
    """Expected calibration error of the confidence, 0..1; 0 without answers."""
    if not answers:
        return 0.0
    said = np.array([answer.confidence for answer in answers])
    right = np.array([is_right(answer) for answer in answers], dtype=np.float64)
    place = np.minimum((said * CONFIDENCE_BINS).astype(int), CONFIDENCE_BINS - 1)
    gaps = [
        abs(said[place == index].mean() - right[place == index].mean()) * (place == index).mean()
        for index in range(CONFIDENCE_BINS)
        if (place == index).any()
    ]
    return float(sum(gaps))


def rest_moved_cm(answers: Sequence[Answer]) -> tuple[float, int]:
    """Farthest that an object at rest was reported from its place, and how many were too far."""
    rest = [a for a in answers if not a.is_moved and a.error is not None]
    farthest = max((answer.moved_cm for answer in rest), default=0.0)
    return farthest, sum(answer.moved_cm > REST_BAR_CM for answer in rest)


def mean_world_cm(answers: Sequence[Answer]) -> float:
    """Mean distance from the truth; 0 without answers."""
    return _mean(answers, lambda a: a.error.world_cm if a.error else UNFOUND_CM)


def mean_yaw_deg(answers: Sequence[Answer]) -> float:
    """Mean yaw error; 0 without answers."""
    return _mean(answers, lambda a: a.error.yaw_deg if a.error else UNFOUND_DEG)


def flips(answers: Sequence[Answer]) -> int:
    """How many yaws are off by more than `FLIP_DEG`, or were not found."""
    return sum(answer.error is None or answer.error.yaw_deg > FLIP_DEG for answer in answers)


def _mean(answers: Sequence[Answer], value: Callable[[Answer], float]) -> float:
    return float(np.mean([value(answer) for answer in answers])) if answers else 0.0
