"""Points of a drawn object that its pose can be measured at: silhouette and texture, in 3D."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tracking.kernels.reduction import REDUCTION
from tracking.window.filters import slopes

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

HALF = 0.5
"""Alpha of the silhouette."""

REACH_PX = REDUCTION.reach_px
"""How far from the contour the width of a part and of the gap beside it is looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """Silhouette points of an object drawn at a pose.

    Attributes:
        points: (N, 3) in the object's frame, metres.
        normals: (N, 2) outward in the picture, unit.
        inner_px: (N,) width of the part inside the contour along the normal, at most `REACH_PX`.
        outer_px: (N,) width of the gap outside.
        colours: (N, 3) float32 of the object a little inside.
    """

    points: Points
    normals: Points
    inner_px: Points
    outer_px: Points
    colours: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def thinned(self, step: int) -> Contour:
        """Every so many points of it."""
        return Contour(
            np.ascontiguousarray(self.points[::step]),
            np.ascontiguousarray(self.normals[::step]),
            np.ascontiguousarray(self.inner_px[::step]),
            np.ascontiguousarray(self.outer_px[::step]),
            np.ascontiguousarray(self.colours[::step]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """Surface points of an object drawn at a pose, where its picture has structure.

    Attributes:
        points: (N, 3) in the object's frame, metres.
        values: (N, 3) float32 smoothed colours there.
        slopes: (N, 3, 2) float32 derivative of the colours per picture pixel (x, y).
    """

    points: Points
    values: FloatArray
    slopes: FloatArray

    def __len__(self) -> int:
        return len(self.points)


def contour_points(
    drawn: Rendering,
    camera: Pinhole | Fisheye,
    object_from_camera: Pose,
    *,
    limit: int,
    reach_px: float = REACH_PX,
) -> Contour:
    """Sub-pixel crossings of alpha = ½, lifted to 3D by the drawn depth.

    The readable twin of `tracking.window.native_reduction.contour_of`.

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


def lift(camera: Pinhole | Fisheye, pixels: Points, depth_m: Points) -> Points:
    """(N, 2) pixels and their depths (z of a pinhole, range of a fisheye) -> (N, 3) points."""
    rays = camera.unproject(pixels)
    along = rays[:, 2:] if isinstance(camera, Pinhole) else 1.0
    return np.ascontiguousarray(rays / along * depth_m[:, None])


def sample(image: FloatArray, pixels: Points) -> FloatArray:
    """Bilinear values at (..., 2) pixels of an (H, W[, C]) float32 picture; the border repeats."""
    height, width = image.shape[:2]
    x = np.clip(pixels[..., 0] - 0.5, 0.0, width - 1.0)
    y = np.clip(pixels[..., 1] - 0.5, 0.0, height - 1.0)
    left, above = x.astype(np.intp), y.astype(np.intp)
    right, below = np.minimum(left + 1, width - 1), np.minimum(above + 1, height - 1)
    across, down = (x - left).astype(np.float32), (y - above).astype(np.float32)
    if image.ndim == 3:
        across, down = across[..., None], down[..., None]
    upper = image[above, left] + across * (image[above, right] - image[above, left])
    lower = image[below, left] + across * (image[below, right] - image[below, left])
    return np.asarray(upper + down * (lower - upper), dtype=np.float32)


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
