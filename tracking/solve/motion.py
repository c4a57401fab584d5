"""Motion of an upright object: its pose as (x, y, z, yaw), and a damped constant velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, wrap_angle

VELOCITY_SHARE = 0.6
"""Share of a newly measured velocity that enters the estimate."""

VELOCITY_DECAY = 0.85
"""Share of the velocity that is trusted one frame later: pushes end abruptly."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A damped constant velocity in (x, y, z, yaw).

    Attributes:
        velocity: (4,) m/s and rad/s.
        t_ns: when it was measured.
    """

    velocity: NDArray[np.float64]
    t_ns: int

    @staticmethod
    def rest(t_ns: int) -> Motion:
        """Standing still."""
        return Motion(np.zeros(4), t_ns)

    def predict(self, pose: Pose, t_ns: int, *, frame_ns: int = 33_000_000) -> Pose:
        """Predict the pose at `t_ns` of an object seen at `pose` when this was measured."""
        elapsed = max(t_ns - self.t_ns, 0)
        decay = VELOCITY_DECAY ** (elapsed / frame_ns)
        return vector_pose(pose_vector(pose) + self.velocity * (elapsed * 1e-9) * decay)

    def measured(self, before: Pose, after: Pose, t_ns: int) -> Motion:
        """After the object went from `before` (at this motion's time) to `after` at `t_ns`."""
        elapsed = (t_ns - self.t_ns) * 1e-9
        if elapsed <= 0:
            return self
        step = pose_vector(after) - pose_vector(before)
        step[3] = wrap_angle(float(step[3]))
        mixed = (1 - VELOCITY_SHARE) * self.velocity + VELOCITY_SHARE * step / elapsed
        return Motion(mixed, t_ns)


def pose_vector(pose: Pose) -> NDArray[np.float64]:
    """(4,) x, y, z in metres and yaw in radians of an upright pose."""
    return np.array([*pose.translation, pose.yaw()])


def vector_pose(vector: NDArray[np.float64]) -> Pose:
    """The upright pose of (4,) x, y, z, yaw."""
    return Pose.from_yaw(float(vector[3]), vector[:3])
