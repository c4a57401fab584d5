"""Depth by plane sweep and semi-global matching, in numpy: the oracle of the native one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.train.depth.stereo import MARGIN, NOISE, PRICES, OtherPhoto

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

REACH_PX = 2
"""Half the side of a census's window, px."""
COUNTED = 3
"""Other photos that count: those most like the photo."""
UNSEEN = 60
"""Cost of a place that fewer than two others can show."""
FAR = 2**14 - 1
"""More than any path costs."""


def inverse_depths(
    grey: NDArray[np.uint8], others: Sequence[OtherPhoto], *, tried: tuple[float, float, int]
) -> FloatArray:
    """(H, W) inverse depth, 0 where it is not known: as `stereo.inverse_depths`."""
    first, step, count = tried
    cost = costs(grey, others, planes=first + step * np.arange(count, dtype=np.float64))
    sums = np.zeros(cost.shape, dtype=np.int64)
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            if (down, across) != (0, 0):
                sums += path_costs(cost, grey, way=(down, across))
    plane = best_planes(sums)
    return np.where(plane < 0, 0.0, first + step * plane)


def costs(grey: NDArray[np.uint8], others: Sequence[OtherPhoto], *, planes: FloatArray) -> IntArray:
    """(H, W, D) bits by which a photo's pixels and the three others most like them differ."""
    own = census(grey)[::2, ::2]
    seen_by = [census(other.grey) for other in others]
    out = np.full((*grey.shape, len(planes)), UNSEEN, dtype=np.int64)
    for number, plane in enumerate(planes):
        unlike = [
            _unlike(own, seen, other, float(plane))
            for seen, other in zip(seen_by, others, strict=True)
        ]
        least = np.sort(np.stack(unlike), axis=0)[:COUNTED]
        seen = np.isfinite(least).sum(axis=0)
        total = np.where(np.isfinite(least), least, 0).sum(axis=0)
        out[..., number] = np.where(seen == 3, total, np.where(seen == 2, total * 3 // 2, UNSEEN))
    return out


def census(grey: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(2 H - 1, 2 W - 1, 48) which neighbours of every half pixel are brighter, which darker."""
    fine = np.zeros((2 * grey.shape[0] - 1, 2 * grey.shape[1] - 1))
    fine[::2, ::2] = grey
    fine[::2, 1::2] = (fine[::2, :-1:2] + fine[::2, 2::2]) / 2
    fine[1::2] = (fine[:-1:2] + fine[2::2]) / 2
    border, steps = 2 * REACH_PX, range(-2 * REACH_PX, 2 * REACH_PX + 1, 2)
    around = [
        np.roll(fine, (-down, -across), axis=(0, 1)) - fine
        for down in steps
        for across in steps
        if (down, across) != (0, 0)
    ]
    out = np.stack([*(more > NOISE for more in around), *(more < -NOISE for more in around)], -1)
    out[:border] = out[-border:] = False
    out[:, :border] = out[:, -border:] = False
    return out


def _unlike(
    own: NDArray[np.bool_], seen: NDArray[np.bool_], other: OtherPhoto, plane: float
) -> FloatArray:
    """(H, W) bits that differ where the pixels are in another photo; inf outside it."""
    height, width = own.shape[:2]
    x, y = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
    pixels = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    moved = other.turn @ pixels + plane * other.shift[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = 2 * moved[:2] / moved[2] + 0.5
    column, row = np.floor(np.nan_to_num(at, nan=-1.0)).clip(-1, 2**31).astype(np.int64)
    inside = (moved[2] > 0) & (column >= 0) & (row >= 0)
    inside &= (column < seen.shape[1]) & (row < seen.shape[0])
    there = seen[np.where(inside, row, 0), np.where(inside, column, 0)].reshape(own.shape)
    differ = (there != own).sum(axis=-1).astype(np.float64)
    return np.where(inside.reshape(differ.shape), differ, np.inf)


def path_costs(cost: IntArray, grey: NDArray[np.uint8], *, way: tuple[int, int]) -> IntArray:
    """(H, W, D) least cost of a path from one border to here (Hirschmüller 2008, equation 13)."""
    small, jump, edge = PRICES
    height, width, _ = cost.shape
    out = np.zeros_like(cost)
    rows = range(height) if way[0] >= 0 else range(height - 1, -1, -1)
    columns = range(width) if way[1] >= 0 else range(width - 1, -1, -1)
    for row in rows:
        for column in columns:
            back = row - way[0], column - way[1]
            out[row, column] = cost[row, column]
            if not (0 <= back[0] < height and 0 <= back[1] < width):
                continue
            last = np.pad(out[back], 1, constant_values=FAR)
            step = abs(int(grey[row, column]) - int(grey[back]))
            over = last.min() + max(jump * edge // (edge + step), small)
            beside = np.minimum(last[:-2], last[2:]) + small
            out[row, column] += np.minimum(np.minimum(last[1:-1], beside), over) - last.min()
    return out


def best_planes(sums: IntArray) -> FloatArray:
    """(H, W) plane with the least sum, with a fraction; -1 where it is not clearly the best."""
    planes = np.arange(sums.shape[2], dtype=np.int64)
    best = sums.argmin(axis=2)
    inner = best.clip(1, len(planes) - 2)
    before, here, after = (
        np.take_along_axis(sums, (inner + k)[..., None], axis=2)[..., 0] for k in (-1, 0, 1)
    )
    is_other = np.abs(planes - best[..., None]) > 1
    second = np.where(is_other, sums, np.iinfo(np.int64).max).min(axis=2)
    off = np.clip(0.5 * (before - after) / np.maximum(before + after - 2 * here, 1), -0.5, 0.5)
    is_clear = (best == inner) & (second >= here * (1 + MARGIN))
    return np.where(is_clear, inner + off, -1.0)
