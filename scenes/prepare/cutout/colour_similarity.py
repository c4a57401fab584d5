# pyright: standard
"""Likelihood ratio of a colour between two kinds, and how usual it is among some."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Colours = NDArray[np.float32] | NDArray[np.float64]

NEAREST_COLOURS = 5
"""Rank of the neighbour whose distance is measured: fewer than that may be wrong."""
COLOUR_NOISE = 0.02
"""Distance added to each, as colours of one surface scatter by that."""
SAME_COLOUR = 0.12
"""Difference of colours (0..1 per channel, Euclidean) up to which they are the same."""
USUAL = 0.05
"""Share of an area that has to be of the same colour for a colour to be the area's."""


def log_likelihood_ratio(
    colours: NDArray[np.float32], *, like: BoolArray, unlike: BoolArray
) -> FloatArray:
    """(K,) how much more likely colours are among one kind than another, -2..2.

    The logarithm of the ratio of how far the nearest such colours are (Loftsgaarden and Quesenberry
    1965); 0 where a kind has too few.
    """
    if min(like.sum(), unlike.sum()) < NEAREST_COLOURS:
        return np.zeros(len(colours))
    far, near = (_distance_to_nearest(colours, colours[kind]) for kind in (unlike, like))
    return np.clip(np.log(far / near), -2.0, 2.0)


def usual(colours: Colours, *, among: Colours, area: FloatArray) -> BoolArray:
    """(K,) whether colours are an area's, and not those of a few spots in it.

    Args:
        colours: (K, 3) in question.
        among: (N, 3) those of the area's splats.
        area: (N,) how much of it each of these is.
    """
    same = cdist(colours, among) < SAME_COLOUR
    return same @ area >= USUAL * area.sum()


def _distance_to_nearest(
    colours: NDArray[np.float32], among: NDArray[np.float32]
) -> NDArray[np.float64]:
    """(K,) how far the fifth-nearest of the colours is: a few wrong ones do not count."""
    distances, _ = KDTree(among).query(colours, k=NEAREST_COLOURS, workers=-1)
    return np.asarray(distances, dtype=np.float64)[:, -1] + COLOUR_NOISE
