"""Check of the camera's motion: the turn of a lens since its pose was found.

A marker does not show that a camera was bumped or that a stand sinks: the marker may have moved
along, jitter more than that, or be absent. The details of a lens picture then are aligned with
those now by a small turn; a shift of centimetres looks like one. People and moved objects are
outliers.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import rotation_from_vector
from tracking.window.contour import sample
from tracking.window.filters import blurred, resized, slopes

WATCH_PX = 480
"""Width in px of the compared pictures: 0.1° is a quarter of their pixels."""

BLUR_PX = 1.5
"""Gaussian blur in px before the comparison."""

COARSE = 6
"""Ratio of the coarse to the fine blur; structure beyond it (shadows, lamps) is removed."""

CELL_PX = 10
"""Side in px of the cells; the steepest pixel of each is used."""

LEAST_STEEP = 0.004
"""Least gradient per px (0..1) of a used pixel."""

STEPS = 5
"""Gauss-Newton steps."""

OUTLIER_SCALES = 3.0
"""Tukey's cut-off in units of 1.5 median absolute residuals."""

LEAST_NOISE = 0.004
"""Least residual scale, grey 0..1."""

LEAST_POINTS = 60
"""Least number of used pixels."""

LEAST_DETAIL_CORRELATION = 0.6
"""Correlation of the aligned details below which no turn is reported."""


FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Watch:
    """The details that a lens saw.

    Attributes:
        camera: the lens at `WATCH_PX`.
        rays: (N, 3) unit, lens frame.
        values: (N,) grey values without coarse structure.
        by_turn: (N, 3) their derivatives by a small turn of the lens, per radian.
    """

    camera: Fisheye
    rays: Points
    values: FloatArray
    by_turn: Points


def watched(image: NDArray[np.uint8], camera: Fisheye) -> Watch:
    """What to compare later pictures with.

    Args:
        image: (H, W, 3) uint8 of the lens.
        camera: the lens.
    """
    detail = _detail(image)
    height, width = detail.shape
    small = camera.resized(width, height)
    gx, gy = slopes(detail)
    y, x = np.mgrid[0:height, 0:width] + 0.5
    inside = np.hypot(x - small.cx, y - small.cy) < 0.95 * small.circle_px
    steep = np.where(inside, np.hypot(gx, gy), 0)
    rows, columns = height // CELL_PX, width // CELL_PX
    cells = steep[: rows * CELL_PX, : columns * CELL_PX].reshape(rows, CELL_PX, columns, CELL_PX)
    cells = cells.swapaxes(1, 2).reshape(rows * columns, CELL_PX**2)
    best = cells.argmax(axis=1)
    kept = np.flatnonzero(cells[np.arange(len(best)), best] > LEAST_STEEP)
    row = kept // columns * CELL_PX + best[kept] // CELL_PX
    column = kept % columns * CELL_PX + best[kept] % CELL_PX
    rays = small.unproject(np.stack([column + 0.5, row + 0.5], axis=1))
    slope = np.stack([gx[row, column], gy[row, column]], axis=1)
    return Watch(small, rays, detail[row, column], _by_turn(small, rays, slope))


def turned_since(watch: Watch, image: NDArray[np.uint8]) -> Points | None:
    """(3,) rotation vector of the lens since the watch began, radians, in the lens's frame then.

    None where too little of what was seen then is seen now.
    """
    if len(watch.rays) < LEAST_POINTS:
        return None
    detail = _detail(image)
    turn = np.zeros(3)
    for _ in range(STEPS):
        residual = _residual(watch, detail, turn)
        noise = max(1.5 * float(np.median(np.abs(residual))), LEAST_NOISE)
        agree = np.clip(1 - (residual / (OUTLIER_SCALES * noise)) ** 2, 0, None) ** 2
        # A turn is so small that pixels change by it as they did at first.
        weighted = watch.by_turn * agree[:, None]
        information = weighted.T @ watch.by_turn
        if np.linalg.cond(information) > 1e8:
            return None
        step = -np.linalg.solve(information, weighted.T @ residual)
        turn = turn + step
        if np.abs(step).max() < 1e-5:
            break
    then = watch.values.astype(np.float64)
    now = then + _residual(watch, detail, turn)
    correlation = float(then @ now) / max(float(np.sqrt((then @ then) * (now @ now))), 1e-12)
    return turn if correlation > LEAST_DETAIL_CORRELATION else None


def _residual(watch: Watch, detail: FloatArray, turn: Points) -> Points:
    """(N,) grey values now less those then, of a lens that was turned."""
    pixels, _ = watch.camera.project(watch.rays @ rotation_from_vector(turn))
    return sample(detail, pixels).astype(np.float64) - watch.values


def _by_turn(camera: Fisheye, rays: Points, slope: FloatArray) -> Points:
    """(N, 3) derivative of the grey values along some rays by a turn of the lens."""
    small = 1e-4
    pixels, _ = camera.project(rays)
    derivative = np.empty((len(rays), 3))
    for axis, unit in enumerate(np.eye(3)):
        shifted, _ = camera.project(rays - small * np.cross(unit, rays))
        derivative[:, axis] = ((shifted - pixels) / small * slope).sum(axis=1)
    return derivative


def _detail(image: NDArray[np.uint8]) -> FloatArray:
    """(H, `WATCH_PX`) grey, 0..1, without its finest and coarsest structure."""
    height = round(WATCH_PX * image.shape[0] / image.shape[1])
    size = (WATCH_PX, height)
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float32) / np.float32(255)
    fine = blurred(grey, BLUR_PX)
    coarse = blurred(resized(fine, (WATCH_PX // 4, height // 4)), COARSE * BLUR_PX / 4)
    return fine - resized(coarse, size)
