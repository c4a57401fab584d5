"""Points of an object in one view, up to its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MIN_POINTS = 60
"""Points of a view below which it says nothing of the object."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenFrom:
    """Points of an object in one view, up to its outline.

    Attributes:
        eye: (3,) where it is seen from.
        points: (K, 3) world points, at the centres of pixels.
        pixel_rad: how wide a pixel is.
    """

    eye: FloatArray
    points: FloatArray
    pixel_rad: float = 0.0

    def above(self, height_m: float) -> FloatArray:
        """(N, 3) what it shows above a height, none if they are too few to measure."""
        points = self.points[self.points[:, 2] > height_m]
        return points if len(points) >= MIN_POINTS else points[:0]

    def met(self, points: FloatArray, level_m: float) -> FloatArray:
        """(N, 2) where rays to points (N, 3) meet a level below the eye, whatever their depths."""
        rays = points - self.eye
        return (self.eye + rays * ((level_m - self.eye[2]) / rays[:, 2:]))[:, :2]
