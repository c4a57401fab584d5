"""Which of two kinds a colour fits better."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

NEAREST_COLOURS = 5
COLOUR_NOISE = 0.02


def likeness(colours: NDArray[np.float32], *, like: BoolArray, unlike: BoolArray) -> FloatArray:
    """(K,) how much more likely colours are among one kind than another, -2..2.

    The logarithm of the ratio of how far the nearest such colours are (Loftsgaarden and Quesenberry
    1965); 0 where a kind has too few.
    """
    if min(like.sum(), unlike.sum()) < NEAREST_COLOURS:
        return np.zeros(len(colours))
    far, near = (_distance_to_nearest(colours, colours[kind]) for kind in (unlike, like))
    return np.clip(np.log(far / near), -2.0, 2.0)


def _distance_to_nearest(
    colours: NDArray[np.float32], among: NDArray[np.float32]
) -> NDArray[np.float64]:
    """(K,) how far the fifth-nearest of the colours is: a few wrong ones do not count."""
    distances, _ = KDTree(among).query(colours, k=NEAREST_COLOURS)
    return np.asarray(distances, dtype=np.float64)[:, -1] + COLOUR_NOISE
