"""Displacements of windows by normalised cross-correlation, over all that a marker may be off."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.camera.displacements import (
    MIN_CORRELATION,
    MIN_RESIDUAL,
    MIN_SLOPE,
    MIN_USABLE,
    Displacements,
    displacements,
    noise_area,
    tensors,
)
from tracking.camera.lens_view import LensView, Sight, lens_view
from tracking.window.filters import box_blurred, slopes

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]
Indices = NDArray[np.intp]

SEARCH_F_PX = 185.0
"""Focal length in px per radian of the picture that is searched: that of a 640-px lens."""

SEARCH_BLUR_PX = 1.5
"""Smoothing of the searched picture, px."""

SEARCH_WINDOW_PX = 23
"""Side in px of its windows, odd."""

SEARCH_RAD = math.radians(3.0)
"""How far a window is looked for: three times a marker's 0.5° and, from 0.5 m on, 1 cm."""


def search_windows(
    sight: Sight, world_from_rig: Pose, *, reach_rad: float = SEARCH_RAD, f_px: float = SEARCH_F_PX
) -> Displacements:
    """Displacements of the best textured windows.

    Args:
        sight: the lens.
        world_from_rig: where the room is drawn from.
        reach_rad: how far a window is looked for.
        f_px: focal length in px per radian of the picture that is searched.
    """
    scale = min(1.0, f_px / sight.camera.f_px)
    size = (round(sight.camera.width_px * scale), round(sight.camera.height_px * scale))
    camera, side = sight.camera.resized(*size), SEARCH_WINDOW_PX
    image = cv2.resize(sight.image, size, interpolation=cv2.INTER_AREA)
    reach = math.ceil(camera.f_px * reach_rad)
    margin = side // 2 + reach
    view = lens_view(
        sight, camera, np.asarray(image, np.uint8), world_from_rig,
        blur_px=SEARCH_BLUR_PX, margin_px=margin,
    )  # fmt: skip
    gx, gy = slopes(view.drawn)
    weight = (view.facing > 0).astype(np.float32)
    products = [_mean(weight * product) for product in (gx * gx, gx * gy, gy * gy)]
    usable = _mean(weight)
    steep = np.where(usable > MIN_USABLE, _common_slope(view, products) * view.facing, 0)
    rows, columns = _best_of_cells(steep.astype(np.float32), side, margin_px=margin + 1)
    found = _found(view, rows, columns, reach)
    kept = found[:, 2] > MIN_CORRELATION
    rows, columns, found = rows[kept], columns[kept], found[kept]
    squared = np.minimum(found[:, 2], 1.0 - MIN_RESIDUAL) ** 2
    noise = _mean(view.drawn * view.drawn)[rows, columns] * (1.0 - squared) / squared
    pixels_per_noise = side**2 / (noise_area(SEARCH_BLUR_PX) * np.maximum(noise, 1e-12))
    information = tensors([product[rows, columns] for product in products])
    nearness = _mean(view.inverse_range * weight) / np.maximum(usable, 1e-6)
    return displacements(
        sight,
        camera,
        np.stack([columns, rows], axis=1).astype(np.float64) + 0.5,
        found[:, :2],
        information * pixels_per_noise[:, None, None],
        range_m=1.0 / nearness[rows, columns].astype(np.float64),
        facing=view.facing[rows, columns].astype(np.float64),
        share=float(kept.mean()) if len(kept) else 0.0,
    )


def _mean(picture: NDArray[np.floating]) -> FloatArray:
    """Mean over the window around each pixel."""
    return box_blurred(picture.astype(np.float32, copy=False), SEARCH_WINDOW_PX)


def _common_slope(view: LensView, products: list[FloatArray]) -> FloatArray:
    """(H, W) geometric mean of both pictures' squared slopes, wherever in the window they are."""
    gx, gy = slopes(view.live)
    live = _mean(gx * gx + gy * gy)
    common = np.sqrt(np.maximum((products[0] + products[2]) * live, 0))
    return np.asarray(np.where(view.facing > 0, common, 0), dtype=np.float32)


def _found(view: LensView, rows: Indices, columns: Indices, reach_px: int) -> Points:
    """(N, 3) displacement x, y in px and correlation of the windows around some pixels."""
    half = SEARCH_WINDOW_PX // 2
    around = half + reach_px
    found = np.zeros((len(rows), 3))
    for index, (row, column) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
        window = view.drawn[row - half : row + half + 1, column - half : column + half + 1]
        place = view.live[row - around : row + around + 1, column - around : column + around + 1]
        correlation = cv2.matchTemplate(place, window, cv2.TM_CCOEFF_NORMED)
        found[index] = _peak(np.asarray(correlation, dtype=np.float32))
    return found


def _best_of_cells(score: FloatArray, cell_px: int, *, margin_px: int) -> tuple[Indices, Indices]:
    """Rows and columns of the best pixel of each cell of a grid, so that no poster takes them all.

    Args:
        score: (H, W).
        cell_px: side of a cell.
        margin_px: from the border that is left out.
    """
    inner = score[margin_px : score.shape[0] - margin_px, margin_px : score.shape[1] - margin_px]
    rows, columns = inner.shape[0] // cell_px, inner.shape[1] // cell_px
    blocks = inner[: rows * cell_px, : columns * cell_px].reshape(rows, cell_px, columns, cell_px)
    flat = blocks.swapaxes(1, 2).reshape(rows * columns, cell_px * cell_px)
    if not flat.size:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    best = flat.argmax(axis=1)
    cell = np.flatnonzero(flat[np.arange(len(flat)), best] > MIN_SLOPE**2)
    row = cell // columns * cell_px + best[cell] // cell_px
    column = cell % columns * cell_px + best[cell] % cell_px
    return row + margin_px, column + margin_px


def _peak(correlation: NDArray[np.float32]) -> tuple[float, float, float]:
    """Place of a correlation's peak, x and y in px from the middle, by a parabola, and its height.

    A peak on the border is none: its height is given as -1.
    """
    _, height, _, (x, y) = cv2.minMaxLoc(correlation)
    reach = correlation.shape[0] // 2
    if not (0 < x < 2 * reach and 0 < y < 2 * reach):
        return 0.0, 0.0, -1.0
    near = correlation[y - 1 : y + 2, x - 1 : x + 2].astype(np.float64)
    slope = 0.5 * np.array([near[1, 2] - near[1, 0], near[2, 1] - near[0, 1]])
    twist = 0.25 * (near[2, 2] + near[0, 0] - near[0, 2] - near[2, 0])
    bend = np.array(
        [
            [near[1, 0] + near[1, 2] - 2 * near[1, 1], twist],
            [twist, near[0, 1] + near[2, 1] - 2 * near[1, 1]],
        ]
    )
    # Along an edge the peak is a ridge: the place on it is arbitrary, but near.
    bend -= np.eye(2) * max(float(np.linalg.eigvalsh(bend)[1]) + 1e-3, 0.0)
    dx, dy = np.clip(-np.linalg.solve(bend, slope), -1.0, 1.0)
    return x - reach + float(dx), y - reach + float(dy), float(height)
