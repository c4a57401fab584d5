"""How far a measured pose may be off: noise, the camera's pose, the scan's scale and its surfaces.

Noise is what a solve reports. An error of the camera moves all that is seen rigidly about the lens,
one of scale moves it along the line of sight; how much of that reaches the pose the solve tells:
what is sure to stand on the floor does not follow upwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracking.evidence import Scene
from tracking.model import TrackModel
from tracking.solve import Fit

SURFACE_SIGMA_M = 0.001
"""How far the surfaces of a scanned object may be off on the whole, as a standard deviation."""

SCALE_SIGMA = 0.001
"""A scan's scale is known to about this share."""

CAMERA_TRUST = 1.5
"""A camera's true error over its reported standard deviation: neighbouring pixels err alike."""


def uncertainty(scene: Scene, model: TrackModel, fit: Fit) -> NDArray[np.float64]:
    """(4, 4) covariance of x, y, z (metres) and yaw (radians) of a measured pose.

    Args:
        scene: the frame, with the camera's pose and its standard deviations.
        model: the object.
        fit: the measurement.
    """
    apart = fit.world_from_object.translation - scene.world_from_rig.translation
    response = fit.response
    along = response[:, :3] @ apart
    by_camera = response @ _moved_by_camera(apart)
    rotation = np.kron(np.eye(2), scene.world_from_rig.rotation)
    variance = (CAMERA_TRUST * scene.camera_sigma) ** 2
    camera = rotation @ np.diag(variance) @ rotation.T
    faults = np.full(4, SURFACE_SIGMA_M**2)
    faults[3] /= model.radius_m**2
    known = fit.covariance + np.diag(faults)
    known += by_camera @ camera @ by_camera.T + SCALE_SIGMA**2 * np.outer(along, along)
    return known


def _moved_by_camera(apart: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6, 6): shift and turn of what is seen at `apart` (m) from a camera by its turn and shift."""
    x, y, z = apart
    moved = np.zeros((6, 6))
    moved[:3, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moved[:3, 3:] = moved[3:, :3] = np.eye(3)
    return moved
