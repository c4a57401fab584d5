"""Smoothing of poses: the paper's Kalman filter and interpolation (paper 4.4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, interpolate, wrap_angle
from tracking.solve.motion import pose_vector, vector_pose

PROCESS_STD = 0.3
MEASUREMENT_STD = 0.1
"""Standard deviations of the paper's filter, "based on empirical tuning" (paper 4.4.2)."""


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
