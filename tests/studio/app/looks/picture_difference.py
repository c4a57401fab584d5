"""Difference of two pictures of a window that ignores fonts and edges within a few pixels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

FINE_PX, COARSE_PX = 8, 64
"""Pixels that are averaged before pictures are compared: more than letters move between two font
libraries; and the side of the parts of which the worst counts."""

MEAN, WORST, SIZE = 2.5, 16.0, 0.05
"""Largest differences, of 255: of the whole picture, and of its worst part; and share by which a
side may be longer."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Of two pictures.

    Attributes:
        mean: of all, 0..255.
        worst: of the part of `COARSE_PX` that differs most.
        size: share by which the sides differ.
    """

    mean: float
    worst: float
    size: float

    @property
    def is_small(self) -> bool:
        """Whether nobody would call them two looks."""
        return self.mean <= MEAN and self.worst <= WORST and self.size <= SIZE


def difference(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> Difference:
    """Compare two pictures, (H, W, 3) RGB of about one size."""
    sides = zip(one.shape[:2], other.shape[:2], strict=True)
    size = max(abs(a - b) / max(a, b) for a, b in sides)
    height, width = (max(1, side // FINE_PX) for side in one.shape[:2])
    fine = [
        cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
        for picture in (one, other)
    ]
    apart = np.abs(fine[0] - fine[1]).max(axis=2)
    step = COARSE_PX // FINE_PX
    parts = [
        apart[top : top + step, left : left + step].mean()
        for top in range(0, height, step)
        for left in range(0, width, step)
    ]
    return Difference(float(apart.mean()), float(max(parts)), size)
