"""A method's answers on an object beside the truth, frame by frame, as plain numbers.

A session of hours has hundreds of thousands of them; as objects they would take six times as much.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scenes.pose import Pose
from scenes.state import TrackState
from studio.evaluate.metrics import PoseError

STATES = tuple(TrackState)
"""By the number that stands for a state in a row."""

POSE = 12
"""Numbers of a pose: nine of the rotation, row by row, three of the place in metres."""

ROW = 2 * POSE + 3 + 5
"""Numbers of a sample without its time: two poses, share seen, state, counted, five errors."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One object at one frame: what a method said and what was true.

    Attributes:
        t_ns: capture time.
        estimated_world_from_object: tracked `world_from_object`.
        true_world_from_object: true `world_from_object`.
        visible: share of the object that the camera saw, 0..1.
        state: what the tracker knew.
        counted: whether the object has moved by now.
        error: how far apart the two poses are.
    """

    t_ns: int
    estimated_world_from_object: Pose
    true_world_from_object: Pose
    visible: float
    state: TrackState
    counted: bool
    error: PoseError


class SampleRows:
    """The samples of one object in order of time."""

    def __init__(self) -> None:
        self._t_ns = array("q")
        self._values = array("d")

    def __len__(self) -> int:
        return len(self._t_ns)

    def add(self, sample: Sample) -> None:
        """Take the next one."""
        error = sample.error
        self._t_ns.append(sample.t_ns)
        self._values.extend(_numbers(sample.estimated_world_from_object))
        self._values.extend(_numbers(sample.true_world_from_object))
        self._values.extend(
            (sample.visible, float(STATES.index(sample.state)), float(sample.counted))
        )
        self._values.extend((error.x_cm, error.y_cm, error.z_cm, error.world_cm, error.yaw_deg))

    def samples(self) -> Iterator[Sample]:
        """All of them, made one at a time."""
        # A copy: while an array is looked into it cannot grow.
        table = np.array(self._values, dtype=np.float64).reshape(-1, ROW)
        for t_ns, row in zip(tuple(self._t_ns), table, strict=True):
            visible, state, counted = row[2 * POSE : 2 * POSE + 3].tolist()
            yield Sample(
                t_ns=t_ns,
                estimated_world_from_object=_pose(row[:POSE]),
                true_world_from_object=_pose(row[POSE : 2 * POSE]),
                visible=visible,
                state=STATES[int(state)],
                counted=bool(counted),
                error=PoseError(*row[2 * POSE + 3 :].tolist()),
            )

    def errors(self, *, hidden: bool | None, below: float) -> list[PoseError]:
        """Errors of the frames that count.

        Args:
            hidden: only frames in which the object was (True) or was not (False) mostly hidden.
            below: seen share under which it counts as hidden, 0..1.
        """
        table = np.array(self._values, dtype=np.float64).reshape(-1, ROW)
        chosen = table[:, 2 * POSE + 2] > 0
        if hidden is not None:
            chosen &= (table[:, 2 * POSE] < below) == hidden
        return [PoseError(*row) for row in table[chosen, 2 * POSE + 3 :].tolist()]


def _numbers(pose: Pose) -> list[float]:
    return [*pose.rotation.ravel().tolist(), *pose.translation.tolist()]


def _pose(row: np.ndarray) -> Pose:
    return Pose(row[:9].reshape(3, 3), row[9:POSE])
