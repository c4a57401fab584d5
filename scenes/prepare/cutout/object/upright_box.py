"""The upright box around an object's splats, standing on what supports it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.cutout.level_planes import support_under
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.object.box_in_masks import LevelRectangle, box_in_masks
from scenes.prepare.cutout.object.level_top import RoundTop, level_top, round_top
from scenes.prepare.cutout.object.side_views import (
    far_ends,
    middle_of_top,
    reach_across,
    widest_reach,
)
from scenes.prepare.cutout.votes.seen_from import SeenFrom
from scenes.prepare.cutout.votes.seen_surface import NOTHING, SeenSurface
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

TAIL = 0.002
"""Share of the weight beyond each face: splats that reach over the edge."""
SOLID = 0.3
"""Opacity below which a splat says little about where the object ends."""
SURFACE_TAIL = 0.0005
"""The same as `TAIL` for points that several views agree about."""
MIN_HEIGHT_M = 0.1
"""Of a lower object the sides are as few pixels as the top: no far rim is separate."""
MAX_REACH_ERROR_M = 0.05
"""How far views may be wrong about how near a level top reaches."""
BEYOND_RIM_M = 0.015
"""An object reaches beyond its round top if it does so by more; less far it cannot reach."""
MIN_SURFACE_POINTS = 300
"""Points of a surface from which on they say more than splats."""


@dataclass(frozen=True, slots=True)
class UprightBox:
    """A box whose vertical axis is up.

    Attributes:
        world_from_box: origin under the box's centre, on the support; Z up, X along the first side.
        size_m: extents (x, y, z).
        support_z_m: height of the support.
        supported: whether a support was found; else the lowest splats stand in for it.
    """

    world_from_box: Pose
    size_m: tuple[float, float, float]
    support_z_m: float
    supported: bool

    def holds(self, points: FloatArray, margin_m: float) -> NDArray[np.bool_]:
        """(N,) whether world points (N, 3) lie in the box or at most a margin beside it."""
        in_box = self.world_from_box.inverse() @ points
        half = 0.5 * np.array(self.size_m)
        beyond = np.abs(in_box - (0.0, 0.0, half[2])) - half
        return np.asarray(beyond.max(axis=1) <= margin_m)


def upright_box(
    cloud: SplatCloud,
    surroundings: SplatCloud,
    surface: SeenSurface = NOTHING,
    masks: Sequence[MaskedView] = (),
) -> UprightBox:
    """The box of an object.

    Of an object that is a box the masks give the place. Of others the yaw is that of the
    smallest rectangle around the object seen from above; extents leave out a small share of the
    opacity at each end, and what hardly any view sees; a round top is as long as wide. Of the four
    yaws alike the one next to the world's axes is taken.

    Args:
        cloud: the object's splats, world frame.
        surroundings: the room without it.
        surface: what views agree about; where it is enough, it decides instead of the splats.
        masks: of the object.

    Raises:
        ValueError: there are fewer than four splats.
    """
    if len(cloud) < 4:
        raise ValueError(f"an object of {len(cloud)} splats, wanted at least 4")
    solid = cloud.opacities >= SOLID
    chosen = cloud.select(solid) if solid.sum() >= 4 else cloud
    points = chosen.means.astype(np.float64)
    weights = chosen.opacities.astype(np.float64)
    bottom, top = _span(points[:, 2], weights, TAIL)
    tail, level_m = TAIL, None
    if len(surface.own) >= MIN_SURFACE_POINTS:
        points, weights, tail = surface.own, np.ones(len(surface.own)), SURFACE_TAIL
        bottom, top = _span(points[:, 2], weights, tail)
        level_m = level_top(points, top)
        top = top if level_m is None else level_m
    ground = surroundings.means[surroundings.opacities >= SOLID].astype(np.float64)
    support = support_under(points, surface.around, ground)
    found, support = support is not None, bottom if support is None else support.height_m
    above = points[:, 2] > support
    if above.sum() >= 4:
        points, weights = points[above], weights[above]
    level_m = level_m if top - support > MIN_HEIGHT_M else None
    disc = None if level_m is None else round_top(surface.by_view, level_m)
    seen = _Seen(surface.by_view, support, level_m, disc)
    level = box_in_masks(masks, points[:, :2], (support, top)) or _around(
        points[:, :2], weights, tail, seen
    )
    return UprightBox(
        Pose.from_yaw(level.yaw, (*level.middle, support)),
        (*level.sides_m, max(top - support, 1e-3)),
        support,
        found,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Points of an object above its support, as single views show them.

    Attributes:
        views: what they show.
        support_m: height of the support.
        level_m: height of the object's level top, if it has one.
        disc: that top, if it is round.
    """

    views: tuple[SeenFrom, ...]
    support_m: float
    level_m: float | None
    disc: RoundTop | None

    def extent(self, axis: FloatArray, agreed: tuple[float, float]) -> tuple[float, float]:
        """Ends of the object along a direction; `agreed` where single views do not show them."""
        widest = widest_reach(self.views, axis, self.support_m)
        if widest is not None:
            # A few strays that views agree about lie beyond what any of them sees much of.
            agreed = max(agreed[0], widest[0]), min(agreed[1], widest[1])
        across = reach_across(self.views, axis, self.support_m)
        if self.disc is not None:
            rim = self.disc.ends(axis)
            least = rim[1] - rim[0] - BEYOND_RIM_M
            if across is None or across[1] - across[0] < least:
                return rim
            return self._beyond(rim, axis, across)
        if across is not None or self.level_m is None:
            return across or agreed
        low, high = far_ends(self.views, axis, self.level_m)
        if low is None and high is not None:
            return self._near_end(axis, high, agreed[0]), high
        if high is None and low is not None:
            return low, self._near_end(axis, low, agreed[1])
        return agreed if low is None or high is None else (low, high)

    def _beyond(
        self, rim: tuple[float, float], axis: FloatArray, across: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the ends of an object along a direction that reaches beyond its round top.

        Legs do so on both sides, and a handle is not only low: what lies low on one side is the
        floor's.
        """
        assert self.level_m is not None
        beyond = rim[0] - across[0] > BEYOND_RIM_M, across[1] - rim[1] > BEYOND_RIM_M
        upper = reach_across(self.views, axis, 0.5 * (self.support_m + self.level_m))
        if all(beyond) or not any(beyond) or upper is None:
            return across
        low, high = (u if there else a for u, a, there in zip(upper, across, beyond, strict=True))
        return low, high

    def _near_end(self, axis: FloatArray, far: float, agreed: float) -> float:
        """Return the near end of a level top seen from one side.

        As far from its middle as the far rim, if it is symmetric; depths measure it too,
        as roughly: both are used.
        """
        assert self.level_m is not None
        middle = middle_of_top(self.views, self.level_m)
        if middle is None:
            return agreed
        mirrored = 2.0 * float(middle @ axis) - far
        return 0.5 * (agreed + mirrored) if abs(mirrored - agreed) < MAX_REACH_ERROR_M else agreed


def _around(places: FloatArray, weights: FloatArray, tail: float, seen: _Seen) -> LevelRectangle:
    """The smallest rectangle around places (N, 2), as far as views see the object reach."""
    yaw = _yaw(places, weights, tail)
    axes = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    (low_x, high_x), (low_y, high_y) = (
        seen.extent(axis, _span(places @ axis, weights, tail)) for axis in axes
    )
    x, y = axes.T @ (0.5 * (low_x + high_x), 0.5 * (low_y + high_y))
    return LevelRectangle((float(x), float(y)), yaw, (high_x - low_x, high_y - low_y))


def _span(values: FloatArray, weights: FloatArray, tail: float) -> tuple[float, float]:
    """Lowest and highest value without a share `tail` of the weight at each end."""
    order = np.argsort(values)
    running = np.cumsum(weights[order]) / weights.sum()
    low, high = np.searchsorted(running, (tail, 1.0 - tail))
    last = len(values) - 1
    return float(values[order[min(low, last)]]), float(values[order[min(high, last)]])


def _yaw(points: FloatArray, weights: FloatArray, tail: float) -> float:
    """Angle of the smallest rectangle around the points seen from above, within ±45°."""
    inner = np.ones(len(points), dtype=bool)
    for axis in (0, 1):
        low, high = _span(points[:, axis], weights, tail)
        inner &= (points[:, axis] >= low) & (points[:, axis] <= high)
    _, _, angle_deg = cv2.minAreaRect(points[inner, :2].astype(np.float32))
    return float(np.deg2rad((angle_deg + 45.0) % 90.0 - 45.0))
