"""How far the tracker is from the truth over time, and when it fails first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.state import ObjectModel, TrackState
from studio.app.timeline.recorded.columns import POSE, STATE, STATES
from studio.app.timeline.recorded.index import RecordingIndex
from studio.evaluate.metrics import pose_errors
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG, SYMMETRY_OF_KIND

MOVED = 13
"""Place in a truth row, after the pose and the visible share: whether it had moved."""


@dataclass(frozen=True, slots=True, eq=False)
class ErrorCurve:
    """One object's error in every frame that has a true pose.

    Attributes:
        t_ns: (N,) times.
        world_cm: (N,) distances, cm.
        yaw_deg: (N,) yaw errors, degrees, symmetry aside.
        counts: (N,) whether the object has moved by then: only then a session is judged by it.
    """

    t_ns: NDArray[np.int64]
    world_cm: NDArray[np.float64]
    yaw_deg: NDArray[np.float64]
    counts: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Failure:
    """When the tracker fails, of what, and how, in words."""

    t_ns: int
    object_id: str
    text: str


def symmetries(objects: Iterable[ObjectModel]) -> Mapping[str, int]:
    """How many yaws of each object look the same, by object id."""
    return {item.object_id: SYMMETRY_OF_KIND.get(item.kind, 1) for item in objects}


def error_curves(index: RecordingIndex, symmetry_of: Mapping[str, int]) -> Mapping[str, ErrorCurve]:
    """Errors by object id, of those that have a true pose.

    Args:
        index: of the recording.
        symmetry_of: by object id; an object that is not in it has none.
    """
    curves: dict[str, ErrorCurve] = {}
    for object_id, tracks in index.tracks.items():
        truth = index.truth.get(object_id)
        if truth is None:
            continue
        _, ours, theirs = np.intersect1d(tracks.t_ns, truth.t_ns, return_indices=True)
        if not len(ours):
            continue
        true = truth.table()
        cm, degrees = pose_errors(
            tracks.table()[ours, :POSE],
            true[theirs, :POSE],
            symmetry=symmetry_of.get(object_id, 1),
        )
        has_moved = np.maximum.accumulate(true[:, MOVED] > 0.5)
        curves[object_id] = ErrorCurve(tracks.t_ns[ours], cm, degrees, has_moved[theirs])
    return curves


def first_failure(index: RecordingIndex, curves: Mapping[str, ErrorCurve]) -> Failure | None:
    """The first frame that fails; None if none does.

    It fails if an object that has moved is off by more than the paper's mean error, or one is lost.
    """
    found: list[Failure] = []
    lost = STATES.index(TrackState.LOST)
    for object_id, tracks in index.tracks.items():
        numbers = np.flatnonzero(tracks.table()[:, STATE] == lost)
        if len(numbers):
            found.append(Failure(int(tracks.t_ns[numbers[0]]), object_id, "lost"))
    for object_id, curve in curves.items():
        is_far, is_turned = curve.world_cm > ROOM_BAR_CM, curve.yaw_deg > ROOM_BAR_DEG
        numbers = np.flatnonzero(curve.counts & (is_far | is_turned))
        if len(numbers):
            at = int(numbers[0])
            text = f"off by {curve.world_cm[at]:.1f} cm, {curve.yaw_deg[at]:.1f}°"
            found.append(Failure(int(curve.t_ns[at]), object_id, text))
    return min(found, key=lambda failure: failure.t_ns, default=None)
