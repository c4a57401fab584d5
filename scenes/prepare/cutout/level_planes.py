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
SUPPORT_REACH_M = 0.06
"""A support is looked for this far above and below the object's lowest points."""
SUNK_SHARE = 0.1
"""Of an object's points: so many may hang through what it stands on. In 35 objects of five rooms it
were at most 0.12, and at least 0.4 where the top of a table beside a chair had been taken for what
the chair stands on; 0.05 and 0.15 do as well."""
BELOW_M = 0.5
"""If there is no support near, one is looked for this far below: thin legs are not always found."""
LEVEL_M = 0.006
"""Height of a bin in which the support is looked for, metres."""
SUPPORT_RING_M = 0.2
"""How far around an object its support is looked for."""
NEAR_LEVEL_M = 0.015
"""Distance from that height within which splats are the support's, metres."""
MIN_LEVEL_POINTS = 60
"""Points of level surfaces that show a support: a flat patch of eight by eight cells."""
MIN_SUPPORT_SPLATS = 12
"""Splats that show one at least."""
TAIL = 0.0005
"""Share of an object's points that may lie below its lowest."""
SCATTERED_M = 0.006
"""Spread of splats from which on they may lie on no level at all: those that are anywhere within
`NEAR_LEVEL_M` have 11 mm. Where depth draws a dark floor into the air, or legs were not found, such
a height was the support: of 82 objects in twelve rooms 19 stood 4 to 70 cm off, and 6 do since.
Measured: 4 to 8 mm give the same within two objects."""
MORE = 1.5
"""Times as many splats that have to lie on another level to take it instead. Measured: 1 to 2 give
the same within two objects."""
MIN_SPREAD_M = 0.002
"""Of a support's points: the best of trained floors are drawn so exactly."""


@dataclass(frozen=True, slots=True)
class Support:
    """Surface that an object stands on: its height, and how its splats scatter there, metres."""

    height_m: float
    spread_m: float


def support_under(
    own: NDArray[np.float64], level: NDArray[np.float64], splats: NDArray[np.float64]
) -> Support | None:
    """The level under or around an object's foot; None if there is none.

    The level that views see most of counts, and splats say where exactly it is: depths drawn on a
    level surface lie a little below it or above. One on which splats only scatter gives way to one
    below on which more of them lie.

    Args:
        own: (N, 3) on the object; some may hang through the table that it lies on.
        level: (M, 3) on level surfaces around it, as views agree about them.
        splats: (K, 3) centres of the room's solid splats.
    """
    if not len(own):
        return None
    low, high = own[:, :2].min(axis=0), own[:, :2].max(axis=0)

    def heights(points: NDArray[np.float64], reach_m: float) -> NDArray[np.float64]:
        near = (points[:, :2] > low - reach_m) & (points[:, :2] < high + reach_m)
        return points[near.all(axis=1), 2]

    drawn, centres = heights(level, SUPPORT_RING_M), heights(splats, SUPPORT_RING_M)
    # A bottle on a stool has more floor around it than seat, but not beside it.
    beside = heights(splats, min(SUPPORT_RING_M, float((high - low).max())))
    bottom, sunk = np.quantile(own[:, 2], (TAIL, SUNK_SHARE), method="lower")
    for among, least in ((drawn, MIN_LEVEL_POINTS), (centres, MIN_SUPPORT_SPLATS)):
        for first, last in (
            (bottom - SUPPORT_REACH_M, max(bottom + SUPPORT_REACH_M, sunk)),
            (bottom - BELOW_M, bottom + SUPPORT_REACH_M),
        ):
            within = among[(among > first) & (among < last)]
            if len(within) >= least:
                found = _lying(centres, at_m=_densest(within))
                below = beside[(beside > bottom - BELOW_M) & (beside < last)]
                if found.spread_m <= SCATTERED_M or len(below) < MIN_SUPPORT_SPLATS:
                    return found
                other = _lying(centres, at_m=_densest(below))
                on = [
                    int((np.abs(beside - support.height_m) < NEAR_LEVEL_M).sum())
                    for support in (found, other)
                ]
                return other if on[1] > MORE * on[0] else found
    return None


def _lying(centres: NDArray[np.float64], *, at_m: float) -> Support:
    """The support at a height, as the splats next to it lie."""
    near = centres[np.abs(centres - at_m) < NEAR_LEVEL_M]
    if len(near) < MIN_SUPPORT_SPLATS:
        return Support(at_m, NEAR_LEVEL_M)
    height = float(np.median(near))
    spread = 1.4826 * float(np.median(np.abs(near - height)))
    return Support(height, max(spread, MIN_SPREAD_M))


def _densest(heights: NDArray[np.float64]) -> float:
    """The height that most are next to."""
    edges = np.arange(heights.min(), heights.max() + 2 * LEVEL_M, LEVEL_M)
    most = int(np.argmax(np.histogram(heights, bins=edges)[0]))
    low, high = edges[max(most - 1, 0)], edges[min(most + 2, len(edges) - 1)]
    return float(np.median(heights[(heights >= low) & (heights <= high)]))


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
