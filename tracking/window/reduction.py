"""Reduction of a rendering to contour, texture and surface points.

The readable twin of `outlined_of` and `looks_of` in `tracking.window.native_reduction`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tracking.kernels.reduction import REDUCTION
from tracking.window.contour import (
    Contour,
    Texture,
    contour_points,
    lift,
    sample,
    texture_points,
)
from tracking.window.extent import part_of
from tracking.window.filters import bell_blurred, resized

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]


TEXTURE_BLUR_PX, TEXTURE_BLUR_REACH_PX = 0.8, 3


SILHOUETTE = 0.5
DEEP_PX = 2.0
"""The colour inside a contour is taken this far from it."""

MIN_COVERED = 0.3
MIN_ALPHA = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Outlined:
    """A drawing's outline, and its picture where it shows anything.

    Attributes:
        part: rows and columns of the window.
        pixels: (N, 2) of the contour, counted from the part's corner.
        contour: in the object's frame, its widths in pixels of the window; colours are to come.
        drawn: the part, with the window's own pixels.
    """

    part: tuple[slice, slice]
    pixels: Points
    contour: Contour
    drawn: Rendering


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """Points on a drawn object, and how it looks there.

    Attributes:
        contour: with the colours inside it.
        texture: surface points with structure.
        surface: (N, 3) points evenly over the silhouette, in the object's frame.
        colours: (N, 3) float32 drawn there, smoothed.
        area_px: pixels of the silhouette.
    """

    contour: Contour
    texture: Texture
    surface: Points
    colours: FloatArray
    area_px: int


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
