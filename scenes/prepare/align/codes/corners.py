# pyright: standard
"""The corners of a printed symbol in a photo, to hundredths of a pixel.

The symbol is known exactly, so the whole square is measured, not four corners: a picture of it is
predicted in the photo's own pixels, through a homography, the light that falls on it, blur and the
bleeding of ink or glare, and Gauss-Newton steps make the prediction and the photo agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.prepare.align.codes.symbols import Symbol

FloatArray = NDArray[np.float64]
Floats = NDArray[np.float32]

MEASURED_SIDE_PX = 160.0
"""Larger symbols are measured at half, a third ... of the size: there is precision to spare."""

RASTER_PX = 8
"""Pixels along a module in the drawing that the prediction is taken from."""

EXTRA_QUIET_MODULES = 12
"""Modules around the quiet zone that are drawn, so that blur finds paper there."""
STEPS = 12
"""Steps of the fit at most."""
STEP_PX = 0.01
"""Movement of the corners, pixels, below which the fit has converged."""
START_BLUR_PX = 0.7
"""Blur that the fit starts from, pixels."""
BLUR_LIMIT_MODULES = 0.9
"""Blur in modules that the fit does not go beyond, plus half a pixel."""

SIGMA_FLOOR_PX = 0.02
"""No corner is better known than this: paper bends, lenses are calibrated to about this much."""

CORRELATED = 3.0
"""Ratio of the corners' scatter to the prediction from noise of single pixels: residuals are
correlated (compression, texture, shadows). Measured on noisy, compressed pictures."""


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """Printed corners of a symbol in a photo.

    Attributes:
        pixels: (4, 2) float64 px: top left, top right, bottom right, bottom left as printed.
        sigma_px: (4,) standard deviation of each corner, along either axis.
        correlation: correlation of photo and prediction, at most 1.
        blur_modules: standard deviation of the blur, in modules of the symbol.
    """

    pixels: FloatArray
    sigma_px: FloatArray
    correlation: float
    blur_modules: float


def refine_corners(
    grey: NDArray[np.uint8], symbol: Symbol, start_px: FloatArray, *, is_close: bool = False
) -> Corners | None:
    """Measure the corners, starting within about half a module of them.

    Args:
        grey: (H, W) sRGB-coded luminance.
        symbol: what is printed there.
        start_px: (4, 2) rough corners, in the order of `Corners.pixels`.
        is_close: whether they are right to a tenth of a module: no rough fit then.

    Returns:
        None if the steps lead nowhere: the symbol is not there, covered, or leaves the picture.
    """
    side_px = math.sqrt(abs(_area(start_px)))
    if side_px < symbol.modules or not np.isfinite(start_px).all():
        return None
    shrink = max(1, math.ceil(side_px / MEASURED_SIDE_PX))
    module_px = side_px / shrink / symbol.modules
    margin_px = 2.5 * module_px + 4.0
    low = np.floor(start_px.min(axis=0) / shrink - margin_px).astype(int)
    high = np.ceil(start_px.max(axis=0) / shrink + margin_px).astype(int)
    low = np.maximum(low, 0)
    high = np.minimum(high, np.array(grey.shape[::-1]) // shrink)
    if (high - low < 8).any():
        return None
    crop = grey[low[1] * shrink : high[1] * shrink, low[0] * shrink : high[0] * shrink]
    light = _linear(crop)
    size = tuple(int(v) for v in high - low)
    if shrink > 1:
        light = cv2.resize(light, size, interpolation=cv2.INTER_AREA)
    fit = _Fit(symbol, np.asarray(light, dtype=np.float32))
    corners = start_px / shrink - low
    if not is_close:
        rough = fit.run(corners, soften_px=0.45 * module_px)
        if rough is None:
            return None
        corners = rough.pixels
    found = fit.run(corners, soften_px=0.0)
    if found is None:
        return None
    return Corners(
        (found.pixels + low) * shrink,
        np.maximum(found.sigma_px * shrink, SIGMA_FLOOR_PX),
        found.correlation,
        found.blur_modules,
    )


class _Fit:
    """One symbol against one crop of a photo, linear light."""

    def __init__(self, symbol: Symbol, light: Floats) -> None:
        self._modules = symbol.modules
        self._quiet = min(symbol.quiet_modules, 2) - 0.25
        self._light = light
        pad = symbol.quiet_modules + EXTRA_QUIET_MODULES
        raster = np.where(np.pad(symbol.dark, pad), 0.0, 1.0)
        self._raster = np.kron(raster, np.ones((RASTER_PX, RASTER_PX))).astype(np.float32)
        self._pad = pad
        height, width = light.shape
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        self._pixels = np.stack([x.ravel(), y.ravel()], axis=1)
        m = float(self._modules)
        self._printed = np.array([[0.0, 0.0], [m, 0.0], [m, m], [0.0, m]])

    def run(self, corners_px: FloatArray, *, soften_px: float) -> Corners | None:
        """Gauss-Newton on corners, blur, bleeding and light, with robust weights."""
        light = self._light
        if soften_px:
            light = np.asarray(cv2.GaussianBlur(light, (0, 0), soften_px), dtype=np.float32)
        module_px = math.sqrt(abs(_area(corners_px))) / self._modules
        blur_px, bleed_px = START_BLUR_PX, 0.0
        corners = corners_px.copy()
        sigma_px, correlation = np.full(4, np.inf), 0.0
        for _ in range(STEPS):
            step = self._step(light, corners, math.hypot(blur_px, soften_px), bleed_px)
            if step is None:
                return None
            change, sigma_px, correlation = step
            longest = float(np.abs(change[:8]).max())
            scale = min(1.0, 0.5 * module_px / max(longest, 1e-12))
            corners = corners + scale * change[:8].reshape(4, 2)
            total = math.hypot(blur_px, soften_px) + scale * float(change[8])
            blur_px = math.sqrt(max(total * total - soften_px * soften_px, 0.09))
            blur_px = min(blur_px, BLUR_LIMIT_MODULES * module_px + 0.5)
            bleed_px = float(
                np.clip(bleed_px + scale * change[9], -0.4 * module_px, 0.4 * module_px)
            )
            if longest < STEP_PX:
                break
        if not np.isfinite(corners).all() or not _is_convex(corners):
            return None
        return Corners(corners, sigma_px, correlation, blur_px / module_px)

    def _step(
        self, light: Floats, corners_px: FloatArray, blur_px: float, bleed_px: float
    ) -> tuple[FloatArray, FloatArray, float] | None:
        """Change of 8 corner coordinates, blur and bleeding; corner sigmas; correlation."""
        if not _is_convex(corners_px):
            return None
        px_from_printed = _homography(self._printed, corners_px)
        printed = _map(_inverse(px_from_printed), self._pixels)
        inside = (printed > -self._quiet).all(axis=1) & (printed < self._modules + self._quiet).all(
            axis=1
        )
        if np.count_nonzero(inside) < 100:
            return None
        drawn = self._draw(px_from_printed, blur_px)
        dx, dy = _slopes(drawn)
        steepness = np.sqrt(dx * dx + dy * dy + 1e-8)
        laplacian = np.asarray(cv2.Laplacian(drawn, cv2.CV_32F), dtype=np.float32)
        drawn = drawn + bleed_px * steepness
        xy = (self._pixels[inside] - corners_px.mean(axis=0)) / 50.0
        value = drawn.ravel()[inside].astype(np.float64)
        wanted = light.ravel()[inside].astype(np.float64)
        ones = np.ones_like(value)
        lit = np.stack([ones, xy[:, 0], xy[:, 1]], axis=1)
        shades = np.concatenate([lit * value[:, None], lit], axis=1)
        slopes = np.stack([dx.ravel()[inside], dy.ravel()[inside]], axis=1).astype(np.float64)
        motion = -_along_corners(slopes, printed[inside], from_xy=self._printed, to_xy=corners_px)
        shape = np.concatenate(
            [
                motion,
                blur_px * laplacian.ravel()[inside, None],
                steepness.ravel()[inside, None],
            ],
            axis=1,
        )
        shading, left, weights = _lit(shades, wanted)
        gain = lit @ shading[:3]
        if float(np.median(gain)) <= 0:
            return None
        columns = np.concatenate([shape * gain[:, None], shades], axis=1)
        weighted = columns * weights[:, None]
        normal = columns.T @ weighted
        normal[np.diag_indices_from(normal)] *= 1.0 + 1e-9
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        change = inverse @ (weighted.T @ left)
        after = left - columns @ change
        variance = float((weights * after * after).sum() / weights.sum())
        corner_variance = CORRELATED**2 * variance * np.diag(inverse)[:8].reshape(4, 2)
        sigma_px = np.sqrt(np.maximum(corner_variance.mean(axis=1), 0.0))
        shown = shades @ shading
        is_blank = float(np.std(shown)) < 1e-9 or float(np.std(wanted)) < 1e-9
        correlation = 0.0 if is_blank else float(np.corrcoef(shown, wanted)[0, 1])
        return change[:10], sigma_px, correlation

    def _draw(self, px_from_printed: FloatArray, blur_px: float) -> Floats:
        """The symbol through the homography, its pixels averaged over their area, then blurred."""
        height, width = self._light.shape
        fine = 3
        raster_from_printed = np.array(
            [
                [RASTER_PX, 0.0, RASTER_PX * self._pad - 0.5],
                [0.0, RASTER_PX, RASTER_PX * self._pad - 0.5],
                [0.0, 0.0, 1.0],
            ]
        )
        px_from_fine = np.array(
            [[1 / fine, 0.0, 0.5 / fine], [0.0, 1 / fine, 0.5 / fine], [0.0, 0.0, 1.0]]
        )
        raster_from_fine = raster_from_printed @ _inverse(px_from_printed) @ px_from_fine
        big = cv2.warpPerspective(
            self._raster,
            raster_from_fine,
            (fine * width, fine * height),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(1.0,),
        )
        small = cv2.resize(big, (width, height), interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.GaussianBlur(small, (0, 0), max(blur_px, 0.2)), dtype=np.float32)


def _lit(shades: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The light that explains the photo best: its coefficients, what is left, and weights."""
    weights = np.ones_like(wanted)
    shading, left = np.zeros(shades.shape[1]), wanted
    for _ in range(2):
        weighted = shades * weights[:, None]
        shading = np.linalg.solve(weighted.T @ shades, weighted.T @ wanted)
        left = wanted - shades @ shading
        spread = 1.4826 * float(np.median(np.abs(left))) + 1e-6
        weights = 1.0 / np.maximum(1.0, np.abs(left) / (2.0 * spread))
    return np.asarray(shading, dtype=np.float64), left, weights


def _linear(grey: NDArray[np.uint8]) -> Floats:
    """Linear light, 0..1, from sRGB code values: blur adds light, not code values."""
    codes = np.arange(256) / 255.0
    table = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return table.astype(np.float32)[grey]


def _slopes(picture: Floats) -> tuple[Floats, Floats]:
    dy, dx = np.gradient(picture)
    return np.asarray(dx, dtype=np.float32), np.asarray(dy, dtype=np.float32)


def _along_corners(
    slopes: FloatArray, at: FloatArray, *, from_xy: FloatArray, to_xy: FloatArray
) -> FloatArray:
    """Change along slopes of where places go when a corner goes elsewhere: of the homography.

    Args:
        slopes: (N, 2) of the picture at the places.
        at: (N, 2) the places, as `from_xy`.
        from_xy: (4, 2) corners that go to `to_xy`.
        to_xy: (4, 2) of the picture.

    Returns:
        (N, 8), a column for each coordinate of `to_xy`.
    """
    equations = _equations(from_xy, to_xy)
    homography = _solved(equations, to_xy)
    # A corner's coordinate on the right side of its equation is a factor on the left, too.
    by_coordinate = np.linalg.inv(equations) * np.repeat(_scales(homography, from_xy), 2)
    ones = np.ones((len(at), 1))
    here = np.hstack([at, ones]) / _scales(homography, at)[:, None]
    along = (slopes * _map(homography, at)).sum(axis=1)
    by_entry = np.hstack(
        [slopes[:, :1] * here, slopes[:, 1:] * here, -along[:, None] * here[:, :2]]
    )
    return np.asarray(by_entry @ by_coordinate, dtype=np.float64)


def _homography(from_xy: FloatArray, to_xy: FloatArray) -> FloatArray:
    """(3, 3) through four pairs of points; the last entry is 1."""
    return _solved(_equations(from_xy, to_xy), to_xy)


def _equations(from_xy: FloatArray, to_xy: FloatArray) -> FloatArray:
    """(8, 8) of the first eight entries of a homography, two for each pair of points."""
    rows = np.zeros((4, 2, 8))
    rows[:, 0, 0:2] = rows[:, 1, 3:5] = from_xy
    rows[:, 0, 2] = rows[:, 1, 5] = 1.0
    rows[:, :, 6:] = -to_xy[:, :, None] * from_xy[:, None, :]
    return rows.reshape(8, 8)


def _solved(equations: FloatArray, to_xy: FloatArray) -> FloatArray:
    return np.append(np.linalg.solve(equations, to_xy.ravel()), 1.0).reshape(3, 3)


def _scales(homography: FloatArray, xy: FloatArray) -> FloatArray:
    """(N,) divisors of mapped places."""
    return np.asarray(xy @ homography[2, :2] + homography[2, 2], dtype=np.float64)


def _inverse(homography: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(homography), dtype=np.float64)


def _map(homography: FloatArray, xy: FloatArray) -> FloatArray:
    three = xy @ homography[:, :2].T + homography[:, 2]
    return three[:, :2] / three[:, 2:]


def _area(corners: FloatArray) -> float:
    """Signed: positive for corners that go round clockwise as one sees them (y down)."""
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _is_convex(corners: FloatArray) -> bool:
    edges = np.roll(corners, -1, axis=0) - corners
    after = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0]
    return bool(np.isfinite(turns).all() and (turns > 1e-6).all())
