"""Poses and people of a recording as plain numbers: a tenth of what objects would take."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.state import Avatar, TrackedObject, TrackState

STATES = tuple(TrackState)
"""By the number that stands for a state in a row."""

POSE = 12
"""Numbers of a pose: nine of the rotation, row by row, three of the place in metres."""

GONE: tuple[float, ...] = ()
"""Row of a person whose avatar has ended."""

VISIBLE, STATE, CONFIDENCE, SEQ = 28, 29, 30, 31
"""Places in the row of a tracked object, after its pose and the sixteen of its covariance."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows of numbers in order of time.

    Attributes:
        t_ns: (N,) when each was true.
        starts: (N + 1,) where each begins in `values`, and the end of the last.
        values: all rows, one after another.
    """

    t_ns: NDArray[np.int64]
    starts: NDArray[np.int64]
    values: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.t_ns)

    def newest(self, t_ns: int) -> int:
        """Number of the last row at or before a time; -1 before the first."""
        return last_at(self.t_ns, t_ns)

    def row(self, number: int) -> NDArray[np.float64]:
        """One row, not to be written to."""
        return self.values[self.starts[number] : self.starts[number + 1]]

    def table(self) -> NDArray[np.float64]:
        """(N, W): all rows; they must be of one length."""
        return self.values.reshape(len(self), -1)


class RowsBuilder:
    """Takes rows in order of time."""

    def __init__(self) -> None:
        self._t_ns = array("q")
        self._starts = array("q", [0])
        self._values = array("d")

    def add(self, t_ns: int, row: Sequence[float]) -> int:
        """Take one; returns how many numbers it has."""
        self._t_ns.append(t_ns)
        self._values.extend(row)
        self._starts.append(len(self._values))
        return len(row)

    def built(self) -> Rows:
        """All that were taken; the builder is of no more use."""
        return Rows(
            np.frombuffer(self._t_ns, dtype=np.int64),
            np.frombuffer(self._starts, dtype=np.int64),
            np.frombuffer(self._values, dtype=np.float64),
        )


def last_at(t_ns: NDArray[np.int64] | Sequence[int], at_ns: int) -> int:
    """Number of the last of these times at or before one; -1 before the first."""
    if isinstance(t_ns, np.ndarray):
        return int(np.searchsorted(t_ns, at_ns, side="right")) - 1
    return bisect_right(t_ns, at_ns) - 1


def pose_row(world_from_item: Pose) -> list[float]:
    """A pose as numbers."""
    rotation, place = world_from_item.rotation, world_from_item.translation
    return [*rotation.ravel().tolist(), *place.tolist()]


def pose_of_row(row: NDArray[np.float64]) -> Pose:
    """Inverse of `pose_row`, of the row's first numbers."""
    return Pose(row[:9].reshape(3, 3), row[9:POSE])


def track_row(track: TrackedObject) -> list[float]:
    """A tracked object as numbers, without its name and time.

    Raises:
        ValueError: its covariance is not (4, 4).
    """
    if track.covariance.shape != (4, 4):
        raise ValueError(f"{track.object_id}: covariance {track.covariance.shape}, wanted (4, 4)")
    return [
        *pose_row(track.world_from_object),
        *track.covariance.ravel().tolist(),
        track.visible_fraction,
        float(STATES.index(track.state)),
        track.confidence,
        float(track.source_seq),
    ]


def track_of_row(object_id: str, t_ns: int, row: NDArray[np.float64]) -> TrackedObject:
    """Inverse of `track_row`."""
    return TrackedObject(
        object_id=object_id,
        t_ns=t_ns,
        world_from_object=pose_of_row(row),
        covariance=row[POSE:VISIBLE].reshape(4, 4).copy(),
        visible_fraction=float(row[VISIBLE]),
        state=STATES[int(row[STATE])],
        confidence=float(row[CONFIDENCE]),
        source_seq=int(row[SEQ]),
    )


NO_RAY = [float("nan")] * 6
"""Numbers of a ray where there is a gaze and no ray."""


def avatar_row(avatar: Avatar, role: int) -> list[float]:
    """A person as numbers: head, role, hands with their counts, ray and gaze if there are any.

    Args:
        avatar: the person.
        role: number that stands for the role.
    """
    row = [*pose_row(avatar.world_from_head), float(role), float(len(avatar.hands))]
    for hand in avatar.hands:
        row += [float(len(hand)), *hand.ravel().tolist()]
    if avatar.ray is not None or avatar.gaze is not None:
        row += NO_RAY if avatar.ray is None else avatar.ray.ravel().tolist()
    if avatar.gaze is not None:
        row += avatar.gaze.ravel().tolist()
    return row


def avatar_of_row(user_id: str, roles: Sequence[str], row: NDArray[np.float64]) -> Avatar:
    """Inverse of `avatar_row`."""
    role, hand_count, at = roles[int(row[POSE])], int(row[POSE + 1]), POSE + 2
    hands: list[NDArray[np.float64]] = []
    for _ in range(hand_count):
        end = at + 1 + 3 * int(row[at])
        hands.append(row[at + 1 : end].reshape(-1, 3).copy())
        at = end
    rays = [row[k : k + 6].reshape(2, 3).copy() for k in range(at, len(row), 6)]
    ray = rays[0] if rays and not np.isnan(rays[0]).any() else None
    gaze = rays[1] if len(rays) > 1 else None
    return Avatar(user_id, role, pose_of_row(row), tuple(hands), ray, gaze=gaze)
