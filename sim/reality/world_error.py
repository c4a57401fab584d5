"""Where a scan's metric world may be wrong: the real room is a little elsewhere and larger.

Codes give the scan's world with an error that the preparation predicts. In the real room that error
lies between what devices report (in the codes' world) and what the tracker draws (the scan).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_vector

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class WorldError:
    """A similarity near to nothing, from the scan's world to the real one.

    Attributes:
        rotation: (3, 3).
        scale: real metres per metre of the scan.
        shift_m: (3,) real metres.
    """

    rotation: Array
    scale: float
    shift_m: Array

    def moved(self, scan_from_body: Pose) -> Pose:
        """Where a body of the scan's world is in the real one."""
        return Pose(
            self.rotation @ scan_from_body.rotation,
            self.scale * self.rotation @ scan_from_body.translation + self.shift_m,
        )


def drawn_error(covariance: Array, rng: np.random.Generator) -> WorldError:
    """An error as large as a preparation expects its own.

    Args:
        covariance: (7, 7) of rotation vector, translation (metres) and logarithm of the scale.
        rng: draws it.
    """
    # By its own axes: a covariance of few photos has some that are nearly zero.
    values, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    change = axes @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(len(values)))
    return WorldError(rotation_from_vector(change[:3]), float(np.exp(change[6])), change[3:6])
