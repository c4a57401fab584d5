"""Covariance of a measured pose: image noise, the camera's pose, errors of the scan's edges.

A solve reports the covariance of noise and of the scan's surface: a uniform edge error is one of
its unknowns (the silhouette bias), a local one shows in correlated residuals. An error of the
camera moves all that is seen rigidly about the lens, one of the scan's edges moves and turns the
object, one of its scale moves it along the line of sight. The solve's response maps these to the
pose: an object held to the floor does not follow upwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracking.evidence.evidence import Scene
from tracking.model.object_model import TrackModel
from tracking.solve.gauss_newton import Fit

EDGE_SIGMA_M = 0.0005
"""Standard deviation in m of a scan's edges on the whole, at any size; divided by the radius, of
its orientation (rad) and scale. Chosen on the rooms lab and desk."""


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
    camera = rotation @ np.diag(scene.camera_sigma**2) @ rotation.T
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
