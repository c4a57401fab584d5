"""Fewer splats for much the same picture: those of a cell merged, or every n-th kept.

Merged groups keep the sum of what their splats cover, their mean colour, and their second moments
(moment matching; Salmond 1990, "Mixture reduction algorithms for target tracking"): for objects of
few pixels. A room is thinned while the camera moves, without being drawn.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation  # pyright: ignore[reportMissingTypeStubs]

from scenes.splats import SplatCloud

Points = NDArray[np.float64]

MAX_OPACITY = 0.999
"""Opacity of a merged splat at most: what a scan's training allows."""

MIN_SCALE = 1e-3
"""Thinnest side of a merged splat, in cells: keeps its covariance invertible."""

BITS = 16


def merged(cloud: SplatCloud, cell_m: float) -> SplatCloud:
    """One splat for all whose means share a cube of a side.

    Args:
        cloud: sound splats (finite, scales above 0).
        cell_m: side of a cube in metres.

    Raises:
        ValueError: the side is not above 0.
    """
    if not cell_m > 0.0:
        raise ValueError(f"merged: cell_m: got {cell_m}, wanted a side above 0 m")
    if len(cloud) == 0:
        return cloud
    means = cloud.means.astype(np.float64)
    group, count = _groups(means, cell_m)
    covered = cloud.opacities.astype(np.float64) * _area(cloud.scales.astype(np.float64))
    weight = covered / np.maximum(_sums(covered, group, count), 1e-30)[group]
    centres = _sums(weight[:, None] * means, group, count)
    apart = means - centres[group]
    spread = cloud.covariances() + apart[:, :, None] * apart[:, None, :]
    covariances = _sums(weight[:, None, None] * spread, group, count)
    variances, axes = np.linalg.eigh(covariances)
    scales = np.sqrt(np.maximum(variances, (MIN_SCALE * cell_m) ** 2))
    axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0
    opacities = _sums(covered, group, count) / _area(scales)
    sh = _sums(weight[:, None, None] * cloud.sh.astype(np.float64), group, count)
    return SplatCloud(
        centres.astype(np.float32),
        scales.astype(np.float32),
        Rotation.from_matrix(axes).as_quat(scalar_first=True).astype(np.float32),
        np.minimum(opacities, MAX_OPACITY).astype(np.float32),
        sh.astype(np.float32),
    )


def thinned(cloud: SplatCloud, count: int) -> SplatCloud:
    """About `count` splats spread as evenly as the cloud's, enlarged to cover what all covered.

    Every n-th along a Z curve is kept. On walls all splats contribute about the same; keeping the
    heaviest would leave holes there.

    Args:
        cloud: any cloud; splats whose mean isn't finite are left out.
        count: how many splats to keep at most; a cloud that has no more comes back as it is.

    Raises:
        ValueError: the count is below 1.
    """
    if count < 1:
        raise ValueError(f"thinned: count: got {count}, wanted at least 1 splat")
    if len(cloud) <= count:
        return cloud
    (sound,) = np.nonzero(np.isfinite(cloud.means).all(axis=1))
    order = sound[z_order(cloud.means[sound].astype(np.float64))]
    steps = (np.arange(count) * (len(order) / count)).astype(np.intp)
    kept = cloud.select(np.sort(order[np.unique(steps)]) if len(order) else order)
    # Areas are of squares: half the splats must be sqrt(2) as large.
    factor = np.float32(np.sqrt(len(order) / max(len(kept), 1)))
    return SplatCloud(kept.means, kept.scales * factor, kept.rotations, kept.opacities, kept.sh)


def _groups(means: Points, cell_m: float) -> tuple[NDArray[np.intp], int]:
    """(N,) index of each mean's cube among those that hold any, and their number."""
    cells = np.floor((means - means.min(axis=0)) / cell_m).astype(np.int64)
    sides = cells.max(axis=0) + 1
    flat = (cells[:, 0] * sides[1] + cells[:, 1]) * sides[2] + cells[:, 2]
    _, group = np.unique(flat, return_inverse=True)
    return group, int(group.max()) + 1


def _sums(values: Points, group: NDArray[np.intp], count: int) -> Points:
    """(count, ...) sums of the values of each group."""
    flat = values.reshape(len(values), -1)
    sums = [np.bincount(group, weights=column, minlength=count) for column in flat.T]
    return np.asarray(np.stack(sums, axis=1), dtype=np.float64).reshape(count, *values.shape[1:])


def _area(scales: Points) -> Points:
    """(N,) what a splat covers seen along its thinnest axis, square metres."""
    longest = np.sort(scales, axis=1)[:, 1:]
    return 2.0 * math.pi * longest.prod(axis=1)


def z_order(where: NDArray[np.floating]) -> NDArray[np.intp]:
    """Indices of (N, 3) finite points along the curve through a cube of 2^16 cells a side.

    Points in the same cell keep their order.
    """
    if len(where) == 0:
        return np.zeros(0, dtype=np.intp)
    low = where.min(axis=0)
    cell = max(float(np.ptp(where, axis=0).max()), 1e-9) / 2**BITS
    grid = ((where - low) / cell).astype(np.uint64).clip(0, 2**BITS - 1)
    code = np.zeros(len(where), dtype=np.uint64)
    for bit in range(BITS):
        for axis in range(3):
            code |= ((grid[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")
