"""Smoothing of poses: the paper's Kalman filter and interpolation, and our damped prediction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, interpolate, wrap_angle

PROCESS_STD = 0.3
MEASUREMENT_STD = 0.1
"""Standard deviations of the paper's filter, "based on empirical tuning" (paper 4.4.2)."""

VELOCITY_SHARE = 0.6
"""Share of a newly measured velocity that enters the estimate."""

VELOCITY_DECAY = 0.85
"""Share of the velocity that is trusted one frame later: pushes end abruptly."""


@dataclass(frozen=True, slots=True, eq=False)
class Kalman:
    """One random-walk filter per component of (x, y, z, yaw): the paper gives only its two noises.

    Attributes:
        value: (4,) metres and radians; yaw is unwrapped.
        variance: (4,) of `value`.
    """

    value: NDArray[np.float64]
    variance: NDArray[np.float64]

    @staticmethod
    def at(pose: Pose) -> Kalman:
        """Certain of a pose up to the measurement noise."""
        return Kalman(pose_vector(pose), np.full(4, MEASUREMENT_STD**2))

    def update(self, measured: Pose) -> Kalman:
        """After one more measurement."""
        predicted = self.variance + PROCESS_STD**2
        gain = predicted / (predicted + MEASUREMENT_STD**2)
        innovation = pose_vector(measured) - self.value
        innovation[3] = wrap_angle(float(innovation[3]))
        return Kalman(self.value + gain * innovation, (1.0 - gain) * predicted)

    def pose(self) -> Pose:
        """The filtered upright pose."""
        return vector_pose(self.value)


@dataclass(frozen=True, slots=True, eq=False)
class Glide:
    """A linear movement from one pose to the next, so that viewers see no jumps (paper 4.4.2).

    Attributes:
        begin: pose at `begin_ns`.
        end: pose at and after `end_ns`.
        begin_ns: session time.
        end_ns: session time, not before `begin_ns`.
    """

    begin: Pose
    end: Pose
    begin_ns: int
    end_ns: int

    def at(self, t_ns: int) -> Pose:
        """The pose at a session time; held before and after the movement."""
        if t_ns >= self.end_ns:
            return self.end
        if t_ns <= self.begin_ns:
            return self.begin
        return interpolate(
            self.begin, self.end, (t_ns - self.begin_ns) / (self.end_ns - self.begin_ns)
        )


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
        """Where an object seen at `pose` when this was measured is likely to be at `t_ns`."""
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
