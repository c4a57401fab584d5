"""Soft shadows that a body casts on the flat surface it stands on.

A point of the surface is darkened by the share of directions in which the body hides the light.
For one direction the hidden points are the body's outline projected along it onto the surface, so
a map is the mean of such outlines: over a cone about the window for the key light, over the
hemisphere for the ambient light.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

MAP_CELLS = 112
SUBCELL_BITS = 4
KEY_CONE_RAD = 0.16
KEY_DIRECTIONS = 12
AMBIENT_DIRECTIONS = 28
MIN_ELEVATION_SINE = 0.2
MAX_DARKNESS = 0.8
"""Light that walls and the body itself send back into the shadow keeps it from being black."""


@dataclass(frozen=True, slots=True, eq=False)
class ShadowMap:
    """Light left on a horizontal surface around a body.

    Attributes:
        light: (N, N) float32, 0..1; row is y, column is x; 1 outside the body's reach.
        low_xy: (2,) world position of the outer corner of cell (0, 0), metres.
        cell_m: side of a cell.
        plane_z_m: height of the surface.
    """

    light: NDArray[np.float32]
    low_xy: NDArray[np.float64]
    cell_m: float
    plane_z_m: float


def shadow_map(
    solids: Sequence[NDArray[np.float64]],
    plane_z_m: float,
    *,
    light_direction: NDArray[np.float64],
    ambient: float,
    key: float,
) -> ShadowMap:
    """Shadow of convex solids on the plane `z = plane_z_m`.

    Args:
        solids: convex point sets (N, 3), world metres.
        plane_z_m: height of the surface.
        light_direction: (3,) unit, towards the main light.
        ambient: share of light from everywhere.
        key: share of light from `light_direction`.
    """
    key_rays = _cone(light_direction, KEY_CONE_RAD, KEY_DIRECTIONS)
    ambient_rays = _hemisphere(AMBIENT_DIRECTIONS)
    points = np.concatenate(solids)
    above = np.maximum(points[:, 2:] - plane_z_m, 0.0)
    reach = np.concatenate([points[:, :2] - above * _slope(ray) for ray in key_rays])
    body_height = float(above.max())
    margin = 0.02 + 0.5 * body_height
    low = np.minimum(reach.min(axis=0), points[:, :2].min(axis=0) - margin)
    high = np.maximum(reach.max(axis=0), points[:, :2].max(axis=0) + margin)
    cell = float((high - low).max()) / (MAP_CELLS - 4)
    low = 0.5 * (low + high) - 0.5 * MAP_CELLS * cell
    hidden_key = _hidden_share(solids, plane_z_m, key_rays, low, cell)
    hidden_ambient = _hidden_share(solids, plane_z_m, ambient_rays, low, cell)
    key_on_plane = key * max(0.0, float(light_direction[2]))
    dark = (ambient * hidden_ambient + key_on_plane * hidden_key) / (ambient + key_on_plane)
    dark = MAX_DARKNESS * cv2.GaussianBlur(dark, (0, 0), 0.9)
    return ShadowMap((1.0 - dark * _fade(MAP_CELLS)).astype(np.float32), low, cell, plane_z_m)


def _hidden_share(
    solids: Sequence[NDArray[np.float64]],
    plane_z_m: float,
    rays: Sequence[NDArray[np.float64]],
    low_xy: NDArray[np.float64],
    cell_m: float,
) -> NDArray[np.float32]:
    hidden = np.zeros((MAP_CELLS, MAP_CELLS), np.float32)
    outline = np.zeros((MAP_CELLS, MAP_CELLS), np.uint8)
    scale = (1 << SUBCELL_BITS) / cell_m
    ends = np.cumsum([len(solid) for solid in solids]).tolist()
    parts = [slice(end - len(solid), end) for end, solid in zip(ends, solids, strict=True)]
    points = np.concatenate(solids)
    above = np.maximum(points[:, 2:] - plane_z_m, 0.0)
    for ray in rays:
        outline[:] = 0
        cells = (points[:, :2] - above * _slope(ray) - low_xy) * scale - (1 << SUBCELL_BITS) / 2
        corners = np.round(cells).astype(np.int32)
        for part in parts:
            hull = cv2.convexHull(corners[part])
            cv2.fillConvexPoly(outline, hull, 1, cv2.LINE_8, SUBCELL_BITS)
        hidden += outline
    return hidden / np.float32(len(rays))


def _slope(ray: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far sideways (x, y) a ray goes for each metre up."""
    return ray[:2] / max(float(ray[2]), MIN_ELEVATION_SINE)


def _cone(axis: NDArray[np.float64], radius_rad: float, count: int) -> list[NDArray[np.float64]]:
    """Unit directions spread evenly over a cone (sunflower pattern)."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    side = np.cross(axis, helper)
    side /= np.linalg.norm(side)
    up = np.cross(side, axis)
    rays: list[NDArray[np.float64]] = []
    for k in range(count):
        radius = math.tan(radius_rad) * math.sqrt((k + 0.5) / count)
        turn = k * math.pi * (3.0 - math.sqrt(5.0))
        ray = axis + radius * (math.cos(turn) * side + math.sin(turn) * up)
        rays.append(ray / np.linalg.norm(ray))
    return rays


def _hemisphere(count: int) -> list[NDArray[np.float64]]:
    """Unit directions above the horizon, denser upwards as the cosine asks (sunflower pattern)."""
    rays: list[NDArray[np.float64]] = []
    for k in range(count):
        radius = math.sqrt((k + 0.5) / count)
        turn = k * math.pi * (3.0 - math.sqrt(5.0))
        rays.append(
            np.array([radius * math.cos(turn), radius * math.sin(turn), math.sqrt(1.0 - radius**2)])
        )
    return rays


def _fade(cells: int) -> NDArray[np.float64]:
    """1 inside, falling smoothly to 0 at the border of the map."""
    t = (np.arange(cells) + 0.5) / cells
    edge = np.clip(8.0 * np.minimum(t, 1.0 - t), 0.0, 1.0)
    smooth = edge * edge * (3.0 - 2.0 * edge)
    return np.outer(smooth, smooth)
