"""The level planes that objects stand on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.splats import SplatCloud

BIN_M = 0.005
"""Height of a bin, metres."""
MIN_LEVEL_SHARE = 0.12
"""Of the splats' area: what lies in one level to be a plane."""
MAX_PLANES = 8
"""Planes that are looked for."""
REACH_M = (0.004, 0.015)
"""How thick a plane may be taken, whatever its splats' noise says."""


@dataclass(frozen=True, slots=True)
class LevelPlane:
    """A level surface: its height, and how far its splats lie from it (2.5 deviations), metres."""

    height_m: float
    reach_m: float


def level_planes(
    cloud: SplatCloud, *, min_share: float = MIN_LEVEL_SHARE
) -> tuple[LevelPlane, ...]:
    """The heights at which much of the splats' area lies, the largest first.

    Args:
        cloud: what surrounds an object, world frame.
        min_share: of the area, to be a plane.
    """
    heights = cloud.means[:, 2].astype(np.float64)
    return levels(heights, level_area(cloud), min_share=min_share)


def levels(
    heights: NDArray[np.float64], area: NDArray[np.float64], *, min_share: float = MIN_LEVEL_SHARE
) -> tuple[LevelPlane, ...]:
    """The heights (N,), metres, at which much of the area (N,) lies, the largest first."""
    planes: list[LevelPlane] = []
    if not len(heights) or area.sum() <= 0:
        return ()
    bins = np.floor((heights - heights.min()) / BIN_M).astype(np.intp) + 1
    level = np.bincount(bins, weights=area, minlength=int(bins.max()) + 2)
    window = np.convolve(level, np.ones(3), mode="same")
    while window.max() > min_share * area.sum() and len(planes) < MAX_PLANES:
        peak = int(np.argmax(window))
        inside = np.abs(bins - peak) <= 1
        height = float(np.average(heights[inside], weights=area[inside]))
        noise = 1.4826 * float(np.median(np.abs(heights[inside] - height)))
        planes.append(LevelPlane(height, float(np.clip(2.5 * noise, *REACH_M))))
        window[max(peak - 3, 0) : peak + 4] = 0.0
    return tuple(planes)


def on_planes(positions: NDArray[np.floating], planes: tuple[LevelPlane, ...]) -> NDArray[np.bool_]:
    """(N,) whether each point lies in one of the planes."""
    found = np.zeros(len(positions), dtype=bool)
    for plane in planes:
        found |= np.abs(positions[:, 2] - plane.height_m) < plane.reach_m
    return found


def level_area(cloud: SplatCloud) -> NDArray[np.float64]:
    """(N,) area of each splat seen from above, times its opacity."""
    flat = cloud.covariances()[:, :2, :2]
    spread = flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] ** 2
    return np.sqrt(np.maximum(spread, 0.0)) * cloud.opacities.astype(np.float64)
