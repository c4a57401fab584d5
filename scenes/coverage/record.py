"""From which directions photos saw each splat of an object, and which parts of its box.

Directions lead from the object to the camera, in the object's frame, so that the record stays true
wherever the object is carried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.coverage.directions import DIRECTIONS, bits_within, middles, unpacked
from scenes.coverage.sides import SIDES

REACH_RAD = math.radians(30.0)
"""A photo speaks for directions up to so far beside its own: photos of a room are taken by steps of
about half a metre, which at one and a half metres is 20 degrees, and cells are 25 degrees wide."""

MIN_SPLATS_SHARE = 0.05
"""Share of the splats that were seen at all, of which a photo's direction must have seen one more
often than by chance: what shows through a gap in a lattice of legs is no view of an object."""


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """Record of what photos saw of one object.

    Attributes:
        directions: (N,) uint64 of the object's splats; bit k where a photo saw the splat from cell
            k of `scenes.coverage.directions`.
        weights: (N,) float32, blend weight of each in all photos, summed over their pixels.
        sides: (6,) uint64 of the sides of its box, in the order of `scenes.coverage.sides.SIDES`;
            bit k where a photo saw cell k from outside.

    Raises:
        ValueError: an array has the wrong shape, or a weight is negative or not finite.
    """

    directions: NDArray[np.uint64]
    weights: NDArray[np.float32]
    sides: NDArray[np.uint64]

    def __post_init__(self) -> None:
        directions = np.array(self.directions, dtype=np.uint64)
        weights = np.array(self.weights, dtype=np.float32)
        sides = np.array(self.sides, dtype=np.uint64)
        if directions.ndim != 1 or weights.shape != directions.shape:
            raise ValueError(
                f"Coverage: directions {directions.shape} and weights {weights.shape}, wanted "
                "(N,) of each, one a splat"
            )
        if sides.shape != (len(SIDES),):
            raise ValueError(f"Coverage.sides: {sides.shape}, wanted ({len(SIDES)},)")
        if not (np.isfinite(weights) & (weights >= 0.0)).all():
            raise ValueError("Coverage.weights: a weight is negative or not finite; measure again")
        for name, array in (("directions", directions), ("weights", weights), ("sides", sides)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.directions)

    def is_seen_from(
        self, towards: NDArray[np.floating], reach_rad: float = REACH_RAD
    ) -> NDArray[np.bool_]:
        """(N,) whether a photo saw each splat from about the direction (N, 3) or (3,).

        Args:
            towards: from the object to an eye, in the object's frame.
            reach_rad: how far beside it a photo may have been.
        """
        return (self.directions & bits_within(towards, reach_rad)) != 0

    def seen_directions(self) -> NDArray[np.bool_]:
        """(64,) the cells of directions from which photos saw the object, or from near by."""
        seen = self.directions != 0
        if not seen.any():
            return np.zeros(DIRECTIONS, dtype=np.bool_)
        count = unpacked(self.directions[seen]).sum(axis=0)
        own = count >= MIN_SPLATS_SHARE * seen.sum()
        towards = middles()
        near = towards @ towards[own].T >= math.cos(REACH_RAD)
        return np.asarray(own | near.any(axis=1), dtype=np.bool_)

    def seen_share_of_sides(self) -> NDArray[np.float64]:
        """(6,) 0..1, share of each side's cells that photos saw."""
        return unpacked(self.sides).mean(axis=1)
