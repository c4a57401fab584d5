# pyright: standard
"""Level top of an object: its height, and the whole of a round one seen from one side only.

What views agree about is rough by a centimetre, and a seat without a pattern comes out tilted
towards those who look at it: the highest of its points say how rough it is, the plane through all
of them how high.

Rays of an outline meet a level top in its rim. They show the far half of the rim and where it ends
to the left and to the right: of a circle that gives the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cutout.object.side_views import MIN_ABOVE_M, MIN_VIEWS, RIM_M
from scenes.prepare.cutout.votes.seen_from import SeenFrom

FloatArray = NDArray[np.float64]

BAND_M = 0.05
"""How far below an object's highest points its top is looked for."""
REACHES_M = (0.025, 0.015, 0.01, 0.008)
"""How near points have to lie to the plane, from one fit to the next."""
MAX_TILT = 0.25
"""Rise over run: what is steeper is no level top."""
MIN_TOP_SHARE = 0.5
"""Of the points in the band: how many the top has to hold."""
MIN_WIDTH_SHARE = 0.5
"""Of the object, across: how far the top has to reach both ways."""
ROUND = 0.05
"""Of the radius: how far the rim in one view may be off a circle (root mean square). Of a square
seen from any side it is 0.10 or more."""
MAX_SHARE_WITHOUT_CIRCLE = 0.5
"""Of the views: how many may see no circle. Those from far away see its far rim roughly."""
BEFORE = 0.1
"""Of the radius: the rim is seen up to so far before the middle."""
RIM_POINTS = 72
"""All around."""
MIN_RIM_POINTS = 12
"""Points of a rim below which no circle is fitted."""
FITS = 6
"""Fits of a circle, each without the points that lie off the last."""


def level_top(points: FloatArray, top_m: float) -> float | None:
    """The height of the level plane that most points under the highest lie in, if there is one.

    Args:
        points: (N, 3) on the object's surface, Z up.
        top_m: height of the highest.
    """
    band = points[points[:, 2] > top_m - BAND_M]
    middle = band.mean(axis=0)
    apart = band - middle
    run = np.column_stack([np.ones(len(apart)), apart[:, :2]])
    plane = np.array([float(np.median(apart[:, 2])), 0.0, 0.0])
    near = np.ones(len(apart), dtype=bool)
    for reach in REACHES_M:
        near = np.abs(apart[:, 2] - run @ plane) < reach
        if near.sum() < max(MIN_TOP_SHARE * len(band), 3):
            return None
        plane = np.linalg.lstsq(run[near], apart[near, 2], rcond=None)[0]
    level = np.hypot(plane[1], plane[2]) <= MAX_TILT
    wide = _width(band[near]) >= MIN_WIDTH_SHARE * _width(points)
    return float(np.median(band[near, 2])) if level and wide else None


def _width(points: FloatArray) -> float:
    """How wide points are where they are narrowest, seen from above: four deviations."""
    return 4.0 * float(np.sqrt(max(np.linalg.eigvalsh(np.cov(points[:, :2].T))[0], 0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class RoundTop:
    """A level disc.

    Attributes:
        middle: (2,) x and y.
        radius_m: of its rim.
    """

    middle: FloatArray
    radius_m: float

    def ends(self, axis: FloatArray) -> tuple[float, float]:
        """Ends along a level direction (2,) of length 1."""
        at = float(self.middle @ axis)
        return at - self.radius_m, at + self.radius_m


def round_top(views: Sequence[SeenFrom], level_m: float) -> RoundTop | None:
    """The disc that an object's level top is; None if it is none, or seen by too few views.

    Args:
        views: what they show of the object.
        level_m: height of the top.
    """
    discs_by_view: list[RoundTop | None] = []
    for view in views:
        points = view.above(level_m - RIM_M)
        if len(points) and view.eye[2] >= level_m + MIN_ABOVE_M:
            discs_by_view.append(_seen_round(view, points, level_m))
    discs = [disc for disc in discs_by_view if disc is not None]
    if len(discs) < max(MIN_VIEWS, (1.0 - MAX_SHARE_WITHOUT_CIRCLE) * len(discs_by_view)):
        return None
    middle = np.median([disc.middle for disc in discs], axis=0)
    radius_m = float(np.median([disc.radius_m for disc in discs]))
    return RoundTop(np.asarray(middle, dtype=np.float64), radius_m)


def _seen_round(view: SeenFrom, points: FloatArray, level_m: float) -> RoundTop | None:
    """The circle that a view sees of the rim, if it is one."""
    met = view.met(points, level_m)
    middle = met.mean(axis=0)
    ahead = middle - view.eye[:2]
    away = float(np.linalg.norm(ahead))
    ahead /= away
    rim = _rim(met)
    # The outline is half a pixel beyond the last pixels' centres.
    outwards = (rim - middle) / np.linalg.norm(rim - middle, axis=1)[:, None]
    range_m = float(np.hypot(away, view.eye[2] - level_m))
    stretch = range_m / (view.eye[2] - level_m) - 1.0
    along = (outwards @ ahead)[:, None] * ahead
    rim = rim + 0.5 * view.pixel_rad * range_m * (outwards + stretch * along)
    left = np.array([-ahead[1], ahead[0]])
    far, disc = rim, RoundTop(middle, 0.5 * float(np.ptp(rim @ left)))
    for _ in range(FITS):
        far = rim[(rim - disc.middle) @ ahead > -BEFORE * disc.radius_m]
        if len(far) < MIN_RIM_POINTS:
            return None
        disc = _circle(far)
    off = np.linalg.norm(far - disc.middle, axis=1) - disc.radius_m
    return disc if float(np.sqrt((off**2).mean())) <= ROUND * disc.radius_m else None


def _rim(places: FloatArray) -> FloatArray:
    """(`RIM_POINTS`, 2) points evenly along the convex hull of places (N, 2)."""
    hull = cv2.convexHull(places.astype(np.float32)).reshape(-1, 2).astype(np.float64)
    closed = np.vstack([hull, hull[:1]])
    run = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
    at = np.arange(RIM_POINTS) * (run[-1] / RIM_POINTS)
    return np.column_stack([np.interp(at, run, closed[:, k]) for k in range(2)])


def _circle(places: FloatArray) -> RoundTop:
    """The circle nearest to places (N, 2): |p|² = 2 p·m + r² - |m|², linear in m and the rest."""
    known = np.column_stack([2.0 * places, np.ones(len(places))])
    x, y, rest = np.linalg.lstsq(known, (places**2).sum(axis=1), rcond=None)[0]
    return RoundTop(np.array([x, y]), float(np.sqrt(max(rest + x * x + y * y, 0.0))))
