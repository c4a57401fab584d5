"""The details of one lens's two pictures: the room drawn through it, and what it sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from tracking.window.filters import blurred, grey, resized, slopes

FloatArray = NDArray[np.float32]

FINE_F_PX = 450.0
"""Focal length in px per radian from which the room is drawn at the lens's own size; for smaller
lenses it is drawn two or three times as large and averaged. The renderer widens every splat by half
a pixel, and where a surface is slanted the nearer ones then hide the farther: at 640 px (183 px per
radian) that turned the camera by 0.05° in `lab` and `desk`, this leaves 0.01°."""

RANGE_M = (0.3, 12.0)
"""Least and most distance in m of what is looked at."""

MIN_COVERAGE = 0.95
"""Least alpha of the drawn room at a used pixel."""

MIN_FACING = 0.5
"""Surfaces more slanted than this cosine are not looked at."""

DETAIL_RATIO = 2.0
"""Structure this many times coarser than the blur is left out: shadows and lamps differ. Between 2
and 5 what is left in a foreign room grows from 0.07° to 0.13°."""


@dataclass(frozen=True, slots=True, eq=False)
class LensView:
    """One lens, drawn and live.

    Attributes:
        camera: the lens at the size that is compared.
        drawn: (H, W) details of the drawn room.
        live: (H, W) details of the live picture.
        inverse_range: (H, W) 1/m.
        facing: (H, W) 0..1, cosine between sight and the surface's normal; 0 where nothing can be
            used.
    """

    camera: Fisheye
    drawn: FloatArray
    live: FloatArray
    inverse_range: FloatArray
    facing: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """One lens and what it sees.

    Attributes:
        camera: the lens.
        rig_from_lens: where it sits.
        image: (H, W, 3) uint8 live picture.
        posed: what is drawn.
        renderer: draws splats.
    """

    camera: Fisheye
    rig_from_lens: Pose
    image: NDArray[np.uint8]
    posed: tuple[PosedSplats, ...]
    renderer: Renderer


def lens_view(
    sight: Sight,
    camera: Fisheye,
    image: NDArray[np.uint8],
    world_from_rig: Pose,
    *,
    blur_px: float,
    margin_px: int,
) -> LensView:
    """Both pictures of a lens at a size, and what of them can be used.

    Args:
        sight: the lens.
        camera: the lens at that size.
        image: its live picture at that size.
        world_from_rig: where the room is drawn from.
        blur_px: of both pictures.
        margin_px: from the border of the lens circle and the picture that is left out, beside what
            the blur reaches.
    """
    width, height = camera.width_px, camera.height_px
    # What is searched need not be drawn finely: what is left of that is measured later.
    finer = 1 if camera is not sight.camera else max(1, round(FINE_F_PX / camera.f_px))
    world_from_lens = world_from_rig @ sight.rig_from_lens
    large = camera.resized(width * finer, height * finer)
    rendering = sight.renderer.render(sight.posed, large, world_from_lens, RenderOptions())
    colour = np.clip(rendering.rgb, np.float32(0), np.float32(1))
    drawn = resized(grey(colour), (width, height))
    alpha, range_m = (resized(a, (width, height)) for a in (rendering.alpha, rendering.depth))
    live = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.float32) / np.float32(255)
    facing = _facing(range_m, camera.f_px)
    usable = (alpha > MIN_COVERAGE) & (range_m > RANGE_M[0]) & (range_m < RANGE_M[1])
    usable &= (facing > MIN_FACING) & _continuous(range_m)
    border = margin_px + math.ceil(DETAIL_RATIO * blur_px)
    x = np.arange(width, dtype=np.float32) + np.float32(0.5 - camera.cx)
    y = np.arange(height, dtype=np.float32) + np.float32(0.5 - camera.cy)
    usable &= x**2 + y[:, None] ** 2 < max(camera.circle_px - border, 0.0) ** 2
    usable[:border], usable[-border:] = False, False
    usable[:, :border], usable[:, -border:] = False, False
    return LensView(
        camera,
        _detail(drawn, blur_px),
        _detail(live, blur_px),
        (1.0 / np.maximum(range_m, np.float32(0.1))).astype(np.float32),
        np.where(usable, facing, np.float32(0)),
    )


def _facing(range_m: FloatArray, f_px: float) -> FloatArray:
    """(H, W) cosine between the line of sight and the surface's normal.

    Splats that overlap on a slanted surface hide each other from behind, which slides its texture
    away from the viewer; a surface seen face on has no such error.
    """
    smooth = blurred(range_m, 2.0)
    gx, gy = slopes(smooth)
    slant = f_px * np.hypot(gx, gy) / np.maximum(smooth, 0.1)
    return (1.0 / np.sqrt(1.0 + slant * slant)).astype(np.float32)


def _continuous(range_m: FloatArray) -> NDArray[np.bool_]:
    """Mask of pixels whose neighbours' ranges agree to 10 %: range means nothing across an edge."""
    kernel = np.ones((5, 5), np.uint8)
    return cv2.dilate(range_m, kernel) - cv2.erode(range_m, kernel) < 0.1 * np.maximum(range_m, 0.1)


def _detail(picture: FloatArray, blur_px: float) -> FloatArray:
    """The picture without its finest and its coarsest structure: no noise, no shadows, no lamps."""
    fine = blurred(picture, blur_px)
    size = (picture.shape[1], picture.shape[0])
    coarse = blurred(resized(fine, (size[0] // 4, size[1] // 4)), DETAIL_RATIO * blur_px / 4)
    return fine - resized(coarse, size)
