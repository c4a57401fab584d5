"""The depth of the surface that splats lie on, for pictures of splats.

A splat counts with its centre's depth wherever it is hit, and near centres come first: on a surface
seen at a slant the expected depth lies in front of it, by about a splat's size. The mean *centre*
of what a pixel hits lies on the surface all the same; so the pixel's ray is cut with the plane
through it, along the splats' mean normal.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose, rotation_from_quaternion
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SH_C0, SplatCloud

MIN_ALPHA = 0.9
"""Opacity of a pixel from which on its depth is of a surface."""
STEEPEST = 0.04
"""Relative change of depth per pixel from which on a pixel lies on an edge: a mean of front and
back."""
MIN_COSINE = 0.15
"""Cosine between ray and normal below which the cut is too uncertain."""
MIN_NORMAL_LENGTH = 0.6
"""Length of the mean normal below which the splats agree on none."""


def surface_depth(
    cloud: SplatCloud, camera: Pinhole, world_from_camera: Pose, *, renderer: NativeRenderer
) -> NDArray[np.float32]:
    """(H, W) float32 z in metres of the surface at each pixel's centre; 0 where it is not sure.

    Args:
        cloud: world frame, metres.
        camera: small pictures are enough.
        world_from_camera: its pose.
        renderer: draws twice.
    """
    camera_from_world = world_from_camera.inverse()
    low = cloud.means.min(axis=0, initial=0.0).astype(np.float64)
    span = max(float((cloud.means.max(axis=0, initial=0.0) - low).max()), 1e-6)

    def mean_of(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        sh = ((values - 0.5) / SH_C0)[:, None, :].astype(np.float32)
        coloured = SplatCloud(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)
        drawn = renderer.render([PosedSplats(coloured, Pose.identity())], camera, world_from_camera)
        sure = np.maximum(drawn.alpha, 1e-6)[..., None]
        return drawn.rgb.astype(np.float64) / sure, drawn.alpha

    centres, alpha = mean_of((cloud.means - low) / span)
    centres = (centres * span + low).reshape(-1, 3)
    normals, _ = mean_of(0.5 + 0.5 * _facing_normals(cloud, world_from_camera.translation))
    normals = (normals.reshape(-1, 3) - 0.5) * 2.0
    in_camera = camera_from_world @ centres
    turned = normals @ camera_from_world.rotation.T
    rays = camera.unproject(pixel_centres(camera))
    rays = rays / rays[:, 2:3]
    slant = (rays * turned).sum(axis=1)
    usable = (np.linalg.norm(normals, axis=1) > MIN_NORMAL_LENGTH) & (
        -slant > MIN_COSINE * np.linalg.norm(rays, axis=1)
    )
    depth = in_camera[:, 2].copy()
    depth[usable] = (in_camera * turned).sum(axis=1)[usable] / slant[usable]
    depth = depth.reshape(alpha.shape)
    sure = (alpha > MIN_ALPHA) & np.isfinite(depth) & (depth > 0) & ~_on_edge(depth)
    return np.ascontiguousarray(np.where(sure, depth, 0.0), dtype=np.float32)


def _facing_normals(cloud: SplatCloud, eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) shortest axes, turned to the eye; the shorter the rounder the splat is."""
    scales = np.sort(cloud.scales.astype(np.float64), axis=1)
    flatness = 1.0 - scales[:, 0] / np.maximum(scales[:, 1], 1e-12)
    rotations = rotation_from_quaternion(cloud.rotations)
    shortest = np.argmin(cloud.scales, axis=1)
    normals = np.take_along_axis(rotations, shortest[:, None, None], axis=2)[..., 0]
    away = ((cloud.means - eye) * normals).sum(axis=1) > 0
    return np.where(away, -1.0, 1.0)[:, None] * normals * flatness[:, None]


def _on_edge(depth: NDArray[np.float64]) -> NDArray[np.bool_]:
    jump = np.zeros(depth.shape)
    inner = np.maximum(
        np.abs(depth[2:, 1:-1] - depth[:-2, 1:-1]), np.abs(depth[1:-1, 2:] - depth[1:-1, :-2])
    )
    jump[1:-1, 1:-1] = inner / 2
    return jump > STEEPEST * np.maximum(depth, 1e-3)
