"""Numpy twin of the reduction of a rendering to contour, texture and surface points.

Native: `native/src/track/appearance/reduction.rs`, `native/src/track/contour.rs`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tracking.kernels.reduction import REDUCTION
from tracking.window.contour import REACH_PX, Contour, Texture, lift, sample
from tracking.window.extent import part_of
from tracking.window.filters import bell_blurred, resized, slopes
from tracking.window.reduction import Looks, Outlined

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

TEXTURE_BLUR_PX, TEXTURE_BLUR_REACH_PX = 0.8, 3

SILHOUETTE = 0.5

DEEP_PX = 2.0
"""The colour inside a contour is taken this far from it."""

MIN_COVERED = 0.3

MIN_ALPHA = 1e-6

HALF = 0.5
"""Alpha of the silhouette."""


def reduce_outline(
    drawn: Rendering, camera: Fisheye, object_from_camera: Pose, *, finer: int
) -> Outlined:
    """Find the outline of a drawing and shrink what it shows to the window's own pixels.

    Args:
        drawn: the object alone.
        camera: it was drawn with.
        object_from_camera: inverse of the pose it was drawn at.
        finer: pixels it was drawn with, each way, per pixel of the window.
    """
    around_px = (
        int(math.sqrt(REDUCTION.around_px2 * float((drawn.alpha > SILHOUETTE).sum()))) // finer
    )
    contour = contour_points(
        drawn,
        camera,
        object_from_camera,
        limit=min(max(around_px, REDUCTION.fewest_points), REDUCTION.most_points),
        reach_px=REDUCTION.reach_px * finer,
    )
    pixels, _ = camera.project(object_from_camera.inverse() @ contour.points)
    rows, columns = (_shown(drawn.alpha, axis, finer) for axis in (0, 1))
    corner = np.array([columns.start, rows.start], dtype=np.float64)
    contour = replace(contour, inner_px=contour.inner_px / finer, outer_px=contour.outer_px / finer)
    return Outlined(
        part=(rows, columns),
        pixels=pixels / finer - corner,
        contour=contour,
        drawn=_seen(drawn, rows, columns, finer),
    )


def _shown(alpha: FloatArray, axis: int, finer: int) -> slice:
    """The window's rows or columns in which anything is shown, with a margin."""
    shown = np.flatnonzero((alpha > 0.0).any(axis=1 - axis))
    first, last = (int(shown[0]), int(shown[-1])) if len(shown) else (0, 0)
    low = max(first // finer - REDUCTION.trim_px, 0)
    return slice(low, min(last // finer + 1 + REDUCTION.trim_px, alpha.shape[axis] // finer))


def _seen(drawn: Rendering, rows: slice, columns: slice, finer: int) -> Rendering:
    """A part of a drawing at the window's own pixels: what a lens makes of it."""
    part = tuple(slice(side.start * finer, side.stop * finer) for side in (rows, columns))
    rgb, alpha, depth = (
        np.ascontiguousarray(picture[part]) for picture in (drawn.rgb, drawn.alpha, drawn.depth)
    )
    if finer == 1:
        return Rendering(rgb, alpha, depth)
    size = (columns.stop - columns.start, rows.stop - rows.start)
    seen = resized(alpha, size)
    depth = resized(depth * alpha, size) / np.maximum(seen, MIN_ALPHA)
    return Rendering(resized(rgb, size), seen, np.asarray(depth, dtype=np.float32))


def measure_looks(
    found: Outlined, drawn: Rendering, window: Fisheye, object_from_camera: Pose
) -> Looks:
    """Pick points of a drawing: with structure, evenly over the silhouette, inside the contour.

    Args:
        found: its outline.
        drawn: the part that shows anything, perhaps with better colours than the outline's.
        window: the camera that the part is of.
        object_from_camera: inverse of the pose it was drawn at.
    """
    camera, contour = part_of(window, found.part), found.contour
    deep = found.pixels - contour.normals * np.minimum(0.5 * contour.inner_px, DEEP_PX)[:, None]
    covered = np.maximum(sample(drawn.alpha, deep), MIN_COVERED)
    colours = np.ascontiguousarray(sample(drawn.rgb, deep) / covered[:, None])
    picture = bell_blurred(drawn.rgb, TEXTURE_BLUR_PX, TEXTURE_BLUR_REACH_PX)
    texture = texture_points(
        drawn,
        picture,
        camera,
        object_from_camera,
        limit=REDUCTION.texture_points,
        min_slope=REDUCTION.least_slope,
    )
    rows, columns = np.nonzero(drawn.alpha > SILHOUETTE)
    area = len(rows)
    if area > REDUCTION.surface_points:
        chosen = np.linspace(0, area - 1, REDUCTION.surface_points).astype(int)
        rows, columns = rows[chosen], columns[chosen]
    pixels = np.stack([columns, rows], axis=1).astype(np.float64) + 0.5
    depth = drawn.depth[rows, columns].astype(np.float64)
    return Looks(
        contour=replace(contour, colours=colours),
        texture=texture,
        surface=object_from_camera @ lift(camera, pixels, depth),
        colours=picture[rows, columns] / drawn.alpha[rows, columns, None],
        area_px=area,
    )


def contour_points(
    drawn: Rendering,
    camera: Pinhole | Fisheye,
    object_from_camera: Pose,
    *,
    limit: int,
    reach_px: float = REACH_PX,
) -> Contour:
    """Sub-pixel crossings of alpha = ½, lifted to 3D by the drawn depth.

    Args:
        drawn: the object alone.
        camera: it was drawn with.
        object_from_camera: inverse of the pose it was drawn at.
        limit: keep about this many points, evenly.
        reach_px: how far parts and gaps are measured.
    """
    alpha = drawn.alpha
    slope_x, slope_y = _blurred_slopes(alpha)
    parts = [_crossings(alpha, slope_x, slope_y, axis) for axis in (0, 1)]
    pixels = np.concatenate([p[0] for p in parts])
    inside = np.concatenate([p[1] for p in parts])
    normals = np.concatenate([p[2] for p in parts])
    if len(pixels) > limit:
        order = np.lexsort((pixels[:, 0], pixels[:, 1]))
        chosen = order[np.linspace(0, len(order) - 1, limit).astype(int)]
        pixels, inside, normals = pixels[chosen], inside[chosen], normals[chosen]
    depth = drawn.depth[inside[:, 1], inside[:, 0]].astype(np.float64)
    inner = _run_length(alpha, pixels, -normals, reach_px, inside=True)
    outer = _run_length(alpha, pixels, normals, reach_px, inside=False)
    points = object_from_camera @ lift(camera, pixels, depth)
    deep = pixels - normals * np.minimum(0.5 * inner, 2.0)[:, None]
    covered = np.maximum(sample(alpha, deep), 0.3)
    colours = sample(drawn.rgb, deep) / covered[:, None]
    return Contour(points, normals, inner, outer, colours.astype(np.float32))


def texture_points(
    drawn: Rendering,
    picture: FloatArray,
    camera: Pinhole | Fisheye,
    object_from_camera: Pose,
    *,
    limit: int,
    min_slope: float,
) -> Texture:
    """The object's inner pixels with the steepest colours.

    Args:
        drawn: the object alone.
        picture: (H, W, 3) its colours, smoothed as the live picture will be.
        camera: it was drawn with.
        object_from_camera: inverse of the pose it was drawn at.
        limit: keep at most this many.
        min_slope: change per pixel, of a 0..1 channel, below which a pixel says nothing.
    """
    slope_x, slope_y = slopes(picture)
    steep2 = np.einsum("hwc,hwc->hw", slope_x, slope_x)
    steep2 += np.einsum("hwc,hwc->hw", slope_y, slope_y)
    inner = cv2.erode((drawn.alpha > 0.9).astype(np.uint8), np.ones((5, 5), np.uint8))
    rows, columns = np.nonzero((inner > 0) & (steep2 > min_slope**2))
    if len(rows) > limit:
        chosen = np.linspace(0, len(rows) - 1, limit).astype(int)
        rows, columns = rows[chosen], columns[chosen]
    pixels = np.stack([columns, rows], axis=1).astype(np.float64) + 0.5
    depth = drawn.depth[rows, columns].astype(np.float64)
    steepness = np.stack([slope_x[rows, columns], slope_y[rows, columns]], axis=2)
    points = object_from_camera @ lift(camera, pixels, depth)
    return Texture(points, picture[rows, columns], steepness)


def _blurred_slopes(alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives along x and y, up to a factor, of the picture blurred by a pixel."""
    offsets = np.arange(-3.0, 4.0)
    bell = np.exp(-0.5 * offsets**2)
    odd = offsets * bell
    border = cv2.BORDER_REPLICATE
    along_x = cv2.sepFilter2D(alpha, cv2.CV_32F, odd, bell, borderType=border)
    along_y = cv2.sepFilter2D(alpha, cv2.CV_32F, bell, odd, borderType=border)
    return np.asarray(along_x, dtype=np.float32), np.asarray(along_y, dtype=np.float32)


def _crossings(
    alpha: FloatArray, slope_x: FloatArray, slope_y: FloatArray, axis: int
) -> tuple[Points, NDArray[np.int64], Points]:
    """Crossings between neighbours along an axis (0: x, 1: y): pixels, inside pixel, normals."""
    near = alpha[:, :-1] if axis == 0 else alpha[:-1]
    far = alpha[:, 1:] if axis == 0 else alpha[1:]
    rows, columns = np.nonzero((near - HALF) * (far - HALF) < 0)
    a, b = near[rows, columns] - HALF, far[rows, columns] - HALF
    fraction = a / (a - b)
    step = np.array([1, 0]) if axis == 0 else np.array([0, 1])
    first = np.stack([columns, rows], axis=1)
    inside = np.where((a > 0)[:, None], first, first + step)
    pixels = first + 0.5 + fraction[:, None] * step
    gradient = np.stack(
        [slope_x[inside[:, 1], inside[:, 0]], slope_y[inside[:, 1], inside[:, 0]]], axis=1
    ).astype(np.float64)
    length = np.linalg.norm(gradient, axis=1)
    # Each stretch of contour is taken once, from the axis it crosses more steeply.
    steeper = np.abs(gradient[:, axis]) >= np.abs(gradient[:, 1 - axis])
    if axis == 1:
        steeper = np.abs(gradient[:, 1]) > np.abs(gradient[:, 0])
    good = (length > 1e-4) & steeper
    normals = -gradient[good] / length[good, None]
    return pixels[good], inside[good], normals


def _run_length(
    alpha: FloatArray, pixels: Points, heading: Points, reach_px: float, *, inside: bool
) -> Points:
    """(N,) pixels one can go along a heading before alpha crosses ½ again, at most a reach."""
    steps = np.arange(0.75, reach_px + 0.01, 0.5)
    path = sample(alpha, pixels[:, None, :] + steps[None, :, None] * heading[:, None, :])
    left = (path < HALF) if inside else (path > HALF)
    first = np.where(left.any(axis=1), steps[np.argmax(left, axis=1)], reach_px)
    return np.maximum(first - 0.25, 1.0)
