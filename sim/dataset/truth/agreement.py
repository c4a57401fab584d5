"""Whether masks and lengths of an object agree with its mesh at its pose, by casting rays.

Independent of what draws: a ray through every pixel's centre, against the mesh as it was written.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.rays import RayScene
from sim.dataset.truth.visibility import box_of

MARGIN_PX = 4
"""Around a mask: a mesh that reaches beyond it by more has no better overlap either."""

RIGID = 1e-6
"""Largest difference of RᵀR from the identity; poses are written with nine digits."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """One object in one picture.

    Attributes:
        pixels: of its silhouette.
        iou: of the silhouette and the mesh, 0..1.
        length_mm: median difference of the written lengths where it is seen; nan if it is hidden.
        visible_outside_px: visible pixels that are not in the silhouette.
    """

    pixels: int
    iou: float
    length_mm: float
    visible_outside_px: int


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """A camera at its place, and what it holds.

    Attributes:
        camera: of the picture.
        world_from_camera: its pose.
        lengths_m: (H, W) written range or depth, metres; 0 where nothing is.
        is_depth: whether lengths are along the axis, not the ray.
    """

    camera: Fisheye | Pinhole
    world_from_camera: Pose
    lengths_m: NDArray[np.float64]
    is_depth: bool


def agreement(
    looked: Looked,
    mesh: RayScene,
    world_from_object: Pose,
    *,
    alone: NDArray[np.bool_],
    visible: NDArray[np.bool_],
) -> Agreement:
    """Compare one object's masks and lengths with its mesh (metres, object frame)."""
    box = box_of(alone)
    outside = int(np.count_nonzero(visible & ~alone))
    if box is None:
        return Agreement(0, 1.0, float("nan"), outside)
    part = np.zeros_like(alone)
    part[
        max(0, box[1] - MARGIN_PX) : box[3] + MARGIN_PX,
        max(0, box[0] - MARGIN_PX) : box[2] + MARGIN_PX,
    ] = True
    y, x = np.nonzero(part)
    rays = looked.camera.unproject(np.stack([x + 0.5, y + 0.5], axis=1))
    object_from_camera = world_from_object.inverse() @ looked.world_from_camera
    start = np.broadcast_to(object_from_camera.translation, rays.shape)
    distance = mesh.cast(start, rays @ object_from_camera.rotation.T).distance.astype(np.float64)
    hit = np.isfinite(distance) & _within(looked.camera, rays)
    there = alone[y, x]
    if looked.is_depth:
        # A view's corner that its lens does not reach holds neither length nor mask.
        hit &= (looked.lengths_m[y, x] > 0) | there
    either = int(np.count_nonzero(hit | there))
    wanted = distance * rays[:, 2] if looked.is_depth else distance
    both = hit & visible[y, x] & (looked.lengths_m[y, x] > 0)
    off = np.abs(looked.lengths_m[y, x][both] - wanted[both])
    return Agreement(
        int(np.count_nonzero(there)),
        np.count_nonzero(hit & there) / either if either else 1.0,
        1e3 * float(np.median(off)) if len(off) else float("nan"),
        outside,
    )


def rigid_error(matrix: NDArray[np.float64]) -> float:
    """How far a (3, 3) rotation is from one: largest entry of RᵀR - I, or 2 if it mirrors."""
    off = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    return off if np.linalg.det(matrix) > 0 else max(off, 2.0)


def _within(camera: Fisheye | Pinhole, rays: NDArray[np.float64]) -> NDArray[np.bool_]:
    if isinstance(camera, Pinhole):
        return np.ones(len(rays), np.bool_)
    return np.arccos(np.clip(rays[:, 2], -1.0, 1.0)) <= camera.max_angle
