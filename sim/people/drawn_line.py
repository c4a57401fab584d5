"""Lines that are being drawn: how long they are, and how much of one is there already."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def length_m(points: Array) -> float:
    """Length of a line through points (N, 3), metres."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def drawn_part(points: Array, share: float) -> Array:
    """(M, 3) the first part of a line (N, 3): its corners so far, and where the pen is.

    Args:
        points: corners of the whole line.
        share: 0..1 of its length.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    at = min(max(share, 0.0), 1.0) * reached[-1]
    passed = points[reached <= at]
    index = len(passed)
    if index >= len(points) or reached[-1] == 0.0:
        return points.copy()
    pen = points[index - 1] + (at - reached[index - 1]) / steps[index - 1] * (
        points[index] - points[index - 1]
    )
    return np.concatenate([passed, pen[None]])
