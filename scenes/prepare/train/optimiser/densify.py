# pyright: standard
"""Densification: faint splats go, those that show the most error are split.

A splat's error is the sum over pixels and pictures of its blend weight times the absolute error
there. Splats are drawn by it and cut in two along their longest axis; the number of splats follows
a schedule up to a fixed budget (as MCMC does it, Kheradmand et al. 2024, but by error instead of by
opacity). What is kept keeps its momentum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import rotation_from_quaternion
from scenes.prepare.train.optimiser.rows import (
    LOG_SCALE,
    MEAN,
    ROTATION,
    TrainingRows,
    fresh_rows,
    joined,
)

FAINT_OPACITY = 0.012
"""Splats below this show next to nothing."""

HALF_STEP = 0.6
"""Distance of the two halves of a split from its middle, in its longest deviation."""
HALF_SCALE = 0.65
"""A half lies so many standard deviations off the whole, and is so much shorter: together they
cover what the whole did."""


def densify(rows: TrainingRows, wanted: int, rng: np.random.Generator) -> TrainingRows:
    """Drop faint and damaged splats, then split the worst until there are `wanted`.

    At most every splat is split once. Errors start again at zero.
    """
    is_sound = np.isfinite(rows.values).all(axis=1)
    kept = rows.select(is_sound & (rows.opacities >= FAINT_OPACITY))
    count = min(max(wanted - len(kept), 0), len(kept))
    worst = _draw(kept.error, count, rng)
    is_split = np.zeros(len(kept), dtype=np.bool_)
    is_split[worst] = True
    whole = kept.select(~is_split)
    after = joined([whole, *_halves(kept.values[worst])])
    return TrainingRows(
        after.values, after.first, after.second, after.steps, np.zeros_like(after.error)
    )


def _draw(error: NDArray[np.float32], count: int, rng: np.random.Generator) -> NDArray[np.integer]:
    """`count` different indices, each drawn by its error (Efraimidis and Spirakis 2006)."""
    weights = np.maximum(error.astype(np.float64), 1e-30)
    keys = rng.exponential(size=len(weights)) / weights
    return np.argpartition(keys, count - 1)[:count] if count else np.empty(0, dtype=np.int64)


def _halves(values: NDArray[np.float32]) -> list[TrainingRows]:
    """Both halves of splats cut across their longest axes."""
    scales = np.exp(values[:, LOG_SCALE].astype(np.float64))
    longest = scales.argmax(axis=1)
    place = np.arange(len(values))
    rotations = rotation_from_quaternion(values[:, ROTATION].astype(np.float64))
    axes = rotations[place, :, longest] * (HALF_STEP * scales[place, longest])[:, None]
    halves = []
    for side in (-1.0, 1.0):
        half = values.copy()
        half[:, MEAN] += (side * axes).astype(np.float32)
        half[place, LOG_SCALE.start + longest] += np.float32(np.log(HALF_SCALE))
        halves.append(fresh_rows(half))
    return halves


def morton_order(means: NDArray[np.float32]) -> NDArray[np.int64]:
    """Order of splats along a Z curve through their bounding cube: neighbours end up together."""
    cells = 2**21 - 1
    low = means.min(axis=0).astype(np.float64)
    side = max(float((means.max(axis=0) - low).max()), 1e-30)
    code = np.zeros(len(means), dtype=np.uint64)
    for axis in range(3):
        cell = ((means[:, axis] - low[axis]) / side * cells).astype(np.uint64)
        code |= _spread(cell) << np.uint64(axis)
    return np.argsort(code, kind="stable")


def _spread(cells: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Two zero bits after each of the low 21 bits."""
    x = cells & np.uint64(0x1FFFFF)
    for shift, mask in (
        (32, 0x001F00000000FFFF),
        (16, 0x001F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        x = (x | (x << np.uint64(shift))) & np.uint64(mask)
    return x
