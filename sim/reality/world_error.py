"""Error of a scan's metric world: the real room is a little elsewhere, larger and bent.

Codes give the scan's world with an error that the preparation predicts. In the real room that error
lies between what devices report (in the codes' world) and what the tracker draws (the scan).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_vector

if TYPE_CHECKING:
    from scenes.package.reality import Reality

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class WorldError:
    """An affine map near to nothing, from the scan's world to the real one.

    Attributes:
        linear: (3, 3), real metres per metre of the scan.
        shift_m: (3,) real metres.
    """

    linear: Array
    shift_m: Array

    @property
    def rotation(self) -> Array:
        """(3, 3) how bodies are turned: the rotation nearest to `linear`."""
        left, _, right = np.linalg.svd(self.linear)
        return left @ right

    def moved(self, scan_from_body: Pose) -> Pose:
        """Move a body of the scan's world to its place in the real one."""
        return Pose(
            self.rotation @ scan_from_body.rotation,
            self.linear @ scan_from_body.translation + self.shift_m,
        )

    def inverse(self) -> WorldError:
        """From the real world to the scan's."""
        back: Array = np.linalg.inv(self.linear).astype(np.float64)
        return WorldError(back, -back @ self.shift_m)

    def without_motion(self, points: Array) -> WorldError:
        """The same seen from where some points (N, 3) of the scan lie best on their real places.

        Who lays the real world onto the scan by these points notices no rigid part of the error.
        """
        real = points @ self.linear.T + self.shift_m
        middle, real_middle = points.mean(axis=0), real.mean(axis=0)
        left, _, right = np.linalg.svd((points - middle).T @ (real - real_middle))
        flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
        turn = left @ flip @ right
        shift: Array = middle + turn @ (self.shift_m - real_middle)
        return WorldError(turn @ self.linear, shift)


def drawn_error(reality: Reality, rng: np.random.Generator) -> WorldError:
    """An error as large as a preparation expects its own.

    A reconstruction that bends away from its codes is strained by a random matrix, whose entries
    give a point as many metres a metre as predicted (`Alignment.predicted_error_m`).

    Args:
        reality: says how well the metric world is known.
        rng: draws it.
    """
    covariance = reality.covariance
    # By its own axes: a covariance of few photos has some that are nearly zero.
    values, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    change = axes @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(len(values)))
    bend = reality.bend_per_metre / np.sqrt(3.0) * rng.standard_normal((3, 3))
    linear = np.exp(change[6]) * rotation_from_vector(change[:3]) + bend
    return WorldError(linear, change[3:6] - bend @ reality.centre_m)
