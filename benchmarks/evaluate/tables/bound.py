"""The best that any estimator could do with an outline: the Cramér-Rao bound of an object's pose.

Along the outline, points sit at pixels `x_i` with unit normals `n_i` and come from 3D points `X_i`;
a pose parameter p moves the outline by `n_i · dπ/dX · dX/dp`. With errors of `SIGMA_PX` along the
normal that are independent every `CORRELATION_PX`, the information is `(1/(σ² L)) ∮ JᵀJ ds` and the
covariance at least its inverse.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from benchmarks.evaluate.protocols.screen import surface_points
from scenes.cameras import Fisheye
from scenes.mesh import PhysicalObject
from scenes.pose import Pose

SIGMA_PX = 0.3
CORRELATION_PX = 3.0
FINE = 6
"""Fine pixels to a camera pixel when the outline is drawn."""

STEP_PX = 0.5
"""Between two points of the outline, camera pixels."""

Points = NDArray[np.float64]


def pose_bound(
    lens: Fisheye,
    world_from_lens: Pose,
    item: PhysicalObject,
    world_from_object: Pose,
    *,
    on_floor: bool,
) -> NDArray[np.float64]:
    """(4, 4) least covariance of x, y, z (metres) and yaw (radians).

    Args:
        lens: the camera; the object is seen by it alone.
        world_from_lens: where it is.
        item: the object.
        world_from_object: where that is.
        on_floor: whether its height is known; the row and column of z are 0 then.

    Raises:
        ValueError: the object is outside the lens.
    """
    in_object = surface_points(item)
    pixels, valid = lens.project(world_from_lens.inverse() @ (world_from_object @ in_object))
    if not valid.all():
        raise ValueError(f"{item.object_id}: partly outside the lens, its outline is not whole")
    middles, normals, lengths = _outline(pixels)
    nearest = KDTree(pixels).query(middles)[1]
    at_outline = in_object[nearest]
    jacobian = np.empty((len(middles), 4))
    small = 1e-5
    for axis in range(4):
        moved = _nudged(world_from_object, axis, small)
        ahead, _ = lens.project(world_from_lens.inverse() @ (moved @ at_outline))
        jacobian[:, axis] = ((ahead - pixels[nearest]) * normals).sum(axis=1) / small
    weights = lengths / (SIGMA_PX**2 * CORRELATION_PX)
    information = (jacobian * weights[:, None]).T @ jacobian
    known = [0, 1, 3] if on_floor else [0, 1, 2, 3]
    covariance = np.zeros((4, 4))
    covariance[np.ix_(known, known)] = np.linalg.inv(information[np.ix_(known, known)])
    return covariance


def bound_in_words(covariance: NDArray[np.float64]) -> tuple[float, float]:
    """Root mean square world error (cm) and yaw error (degrees) of the bound."""
    world_cm = 100.0 * math.sqrt(float(np.trace(covariance[:3, :3])))
    return world_cm, math.degrees(math.sqrt(float(covariance[3, 3])))


def _nudged(pose: Pose, axis: int, step: float) -> Pose:
    if axis == 3:
        return Pose.from_yaw(pose.yaw() + step, pose.translation)
    shift = np.zeros(3)
    shift[axis] = step
    return Pose(pose.rotation, pose.translation + shift)


def _outline(pixels: Points) -> tuple[Points, Points, NDArray[np.float64]]:
    """Middles, unit normals and lengths (camera pixels) of pieces of the silhouette's outline.

    The silhouette is the union of dots: surface points are less than a fine pixel's dot apart.
    """
    low = np.floor(pixels.min(axis=0)) - 2
    size = np.ceil((pixels.max(axis=0) + 2 - low) * FINE).astype(int)
    mask = np.zeros((size[1], size[0]), np.uint8)
    fine = ((pixels - low) * FINE).astype(int)
    mask[fine[:, 1], fine[:, 0]] = 255
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    contours, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    middles, normals, lengths = [], [], []
    for contour in contours:
        points = np.asarray(contour, dtype=np.float64).reshape(-1, 2)
        if len(points) < 6 * FINE:
            continue
        # Steps of whole fine pixels are jagged: take longer chords of a smoothed line.
        padded = np.concatenate([points[-FINE:], points, points[:FINE]])
        kernel = np.ones(2 * FINE + 1) / (2 * FINE + 1)
        line = np.stack([np.convolve(padded[:, k], kernel, "valid") for k in (0, 1)], axis=1)
        stride = max(1, round(STEP_PX * FINE))
        corners = line[::stride]
        chords = np.roll(corners, -1, axis=0) - corners
        length = np.linalg.norm(chords, axis=1)
        keep = length > 1e-6
        normal = np.stack([chords[:, 1], -chords[:, 0]], axis=1)[keep] / length[keep, None]
        middles.append((corners + 0.5 * chords)[keep] / FINE + low + 0.5 / FINE)
        normals.append(normal)
        lengths.append(length[keep] / FINE)
    return np.concatenate(middles), np.concatenate(normals), np.concatenate(lengths)
