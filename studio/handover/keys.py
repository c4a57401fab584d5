"""Motion as the fewest moments that show the same: between two of them one interpolates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from scenes.pose import Pose

MAX_KEYS = 20_000
"""Of one body, chosen: ten minutes of a body that never rests, at 30 frames a second."""

POSITION_STEP_M = 0.001
"""A body that moved less has not moved, chosen: below a pixel of any view of a room."""

QUATERNION_STEP = 0.001
"""As large a difference of one component is a turn by about 0.1°."""

POSE_STEPS = (POSITION_STEP_M,) * 3 + (QUATERNION_STEP,) * 4
"""By which a pose's numbers (x, y, z, then w, x, y, z) must differ to be another pose."""

Values = tuple[float, ...]


@dataclass(slots=True)
class Keys:
    """Numbers that change with time, kept where they change.

    Of a rest, the first and the last moment are kept. When there are too many, every second one
    goes, and from then on they are kept half as often: memory stays within `MAX_KEYS`.

    Attributes:
        steps: by how much each number must differ to count as changed.
        most: keys that are kept at most.
        t_ms: times of the keys, whole milliseconds of the session.
        values: one tuple a key; None while there is nothing.
    """

    steps: Values
    most: int = MAX_KEYS
    t_ms: list[int] = field(default_factory=list[int])
    values: list[Values | None] = field(default_factory=list["Values | None"])
    _resting: tuple[int, Values | None] | None = None
    _every_ms: int = 0

    def add(self, t_ms: int, values: Sequence[float] | None) -> None:
        """Take what it is at a time, which is not before the last one's."""
        new = None if values is None else tuple(float(value) for value in values)
        if self.t_ms and not self._differs(new):
            self._resting = (t_ms, self.values[-1])
            return
        if self.t_ms and t_ms - self.t_ms[-1] < self._every_ms and not self._appears(new):
            return
        if self._resting is not None:
            self._keep(*self._resting)
            self._resting = None
        self._keep(t_ms, new)
        if len(self.t_ms) > self.most:
            self._thin()

    def _differs(self, new: Values | None) -> bool:
        last = self.values[-1]
        if last is None or new is None:
            return last is not new
        return any(abs(a - b) > step for a, b, step in zip(last, new, self.steps, strict=True))

    def _appears(self, new: Values | None) -> bool:
        return (self.values[-1] is None) != (new is None)

    def _keep(self, t_ms: int, values: Values | None) -> None:
        if self.t_ms and self.t_ms[-1] == t_ms:
            self.values[-1] = values
            return
        self.t_ms.append(t_ms)
        self.values.append(values)

    def _thin(self) -> None:
        span_ms = self.t_ms[-1] - self.t_ms[0]
        self.t_ms[:-1] = self.t_ms[:-1:2]
        self.values[:-1] = self.values[:-1:2]
        self._every_ms = max(2 * self._every_ms, 2 * span_ms // self.most, 1)


def pose_values(world_from_body: Pose, after: Values | None) -> Values:
    """x, y, z in metres and the quaternion w, x, y, z, of the sign that is nearer to `after`."""
    quaternion = world_from_body.quaternion()
    if after is not None and float(quaternion @ np.array(after[3:])) < 0.0:
        quaternion = -quaternion
    return (*world_from_body.translation.tolist(), *quaternion.tolist())
