"""Shadows are laid band by band and only where they fall: the same to the bit as all at once."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.pose import Pose
from sim.camera.lens_picture import DrawnBody, Layer, Tolerances, compose
from sim.camera.lens_raster import PixelRect
from sim.camera.shadows import ShadowMap

SIZE = 512
DOWN = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1.6]))
"""A lens 1.6 m above the floor that looks straight down."""


def _at_once(layer, rect, shadow, lens, lens_from_world, tolerance_m):
    """The whole rectangle in one piece, nothing left out."""
    columns, rows = -(-rect.width_px // 8) + 2, -(-rect.height_px // 8) + 2
    x = rect.x0 + 8 * (np.arange(columns) - 0.5)
    y = rect.y0 + 8 * (np.arange(rows) - 0.5)
    grid_x, grid_y = np.meshgrid(x, y)
    rays = lens.unproject(np.stack([grid_x.ravel(), grid_y.ravel()], axis=1))
    world_from_lens = lens_from_world.inverse()
    rays = rays @ world_from_lens.rotation.T
    eye = world_from_lens.translation
    plane_range = (shadow.plane_z_m - eye[2]) / np.minimum(rays[:, 2], -1e-3)
    hit = eye[:2] + plane_range[:, None] * rays[:, :2]
    cells = ((hit - shadow.low_xy) / shadow.cell_m - 0.5).astype(np.float32)
    maps = [np.ascontiguousarray(cells[:, axis].reshape(rows, columns)) for axis in (0, 1)]
    light = cv2.remap(
        shadow.light * np.float32(255),
        *maps,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=255.0,
    )
    wide = (columns * 8, rows * 8)
    inner = (slice(8, 8 + rect.height_px), slice(8, 8 + rect.width_px))
    factor = cv2.resize(light, wide)[inner].copy()
    distance = cv2.resize(plane_range.reshape(rows, columns).astype(np.float32), wide)[inner]
    factor[np.abs(distance - layer.range_m) > np.float32(tolerance_m)] = 255.0
    factor[layer.ids != 0] = 255.0
    share = np.rint(factor)[..., None]
    return np.rint(layer.rgb * share / 255.0).astype(np.uint8)


def _floor(lens, lens_from_world, rng):
    """A layer of the bare floor, with another body's number and a step in some places."""
    ys, xs = np.mgrid[0:SIZE, 0:SIZE] + 0.5
    rays = lens.unproject(np.stack([xs.ravel(), ys.ravel()], axis=1))
    rays = rays @ lens_from_world.inverse().rotation.T
    range_m = (-1.6 / np.minimum(rays[:, 2], -1e-3)).reshape(SIZE, SIZE).astype(np.float32)
    range_m[rng.random((SIZE, SIZE)) < 0.1] = np.inf
    range_m[100:140] += 0.4
    rgb = rng.integers(0, 256, (SIZE, SIZE, 3), dtype=np.uint8)
    ids = (rng.random((SIZE, SIZE)) < 0.1).astype(np.uint8)
    return Layer(rgb, range_m, ids)


@pytest.mark.parametrize(
    "rect",
    [PixelRect(0, 0, SIZE, SIZE), PixelRect(53, 38, 471, 401), PixelRect(250, 250, 262, 253)],
)
@pytest.mark.parametrize("middle", [(0.1, -0.2), (0.9, 0.6), (-8.0, 0.0)])
def test_a_shadow_in_bands_is_the_shadow_at_once(rect, middle):
    rng = np.random.default_rng(7)
    lens = Fisheye.from_fov(SIZE, math.radians(170.0))
    lens_from_world = DOWN.inverse()
    below = _floor(lens, lens_from_world, rng)
    x, y = np.meshgrid(np.linspace(-1, 1, 112), np.linspace(-1, 1, 112))
    dark = 0.7 * np.clip(1.0 - np.hypot(x, 2.0 * y), 0.0, 1.0)
    low = np.array(middle) - 0.5
    shadow = ShadowMap((1.0 - dark).astype(np.float32), low, 1.0 / 112, 0.0)
    nobody = np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.float32)
    body = DrawnBody(1, None, *nobody, 0, shadow, PixelRect(0, 0, SIZE, SIZE))
    layer = compose(
        below,
        rect,
        [body],
        lens=lens,
        lens_from_world=lens_from_world,
        tolerances=Tolerances(),
    )
    wanted = _at_once(below.part(rect), rect, shadow, lens, lens_from_world, Tolerances().shadow_m)
    assert np.array_equal(layer.rgb, wanted)
    if middle == (0.1, -0.2):
        assert (layer.rgb != below.part(rect).rgb).any()
