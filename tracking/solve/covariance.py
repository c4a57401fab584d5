"""How far a measured pose may be off: what its outline tells, the camera's pose, the scan's edges.

A solve reports what noise and the scan's surfaces make of it: where these are off on the whole is
one of its unknowns (the halo), where they are off in places shows in residuals that are alike. An
error of the camera moves all that is seen rigidly about the lens, one of the scan's edges moves and
turns the thing itself, and one of its scale moves it along the line of sight; how much of that
reaches the pose the solve tells: what is sure to stand on the floor does not follow upwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracking.evidence.evidence import Scene
from tracking.model.object_model import TrackModel
from tracking.solve.gauss_newton import Fit

EDGE_SIGMA_M = 0.0005
"""On the whole a scan's edges are known to so much, whatever its size: so well its place is known,
and, in shares of its radius, how it is turned and how large it is."""

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
    share = EDGE_SIGMA_M / model.radius_m
    edges = np.diag(np.repeat((EDGE_SIGMA_M, share), 3) ** 2)
    by_scan = response @ edges @ response.T + share**2 * np.outer(along, along)
    return fit.covariance + by_camera @ camera @ by_camera.T + by_scan


def _moved_by_camera(apart: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6, 6): shift and turn of what is seen at `apart` (m) from a camera by its turn and shift."""
    x, y, z = apart
    moved = np.zeros((6, 6))
    moved[:3, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moved[:3, 3:] = moved[3:, :3] = np.eye(3)
    return moved
