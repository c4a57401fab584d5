# pyright: standard
"""The height of an object's level top.

What views agree about is rough by a centimetre, and a seat without a pattern comes out tilted
towards those who look at it: the highest of its points say how rough it is, the plane through all
of them how high.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
