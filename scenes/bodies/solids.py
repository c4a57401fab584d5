"""Solid boxes that hands stay out of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes.bodies.vectors import Array
from scenes.pose import Pose

MAX_DEPTH_M = 0.01
"""How deep a hand may be in a solid, metres: less than what a scan's surface is rough by."""

SKIN_M = 0.012
"""Half the thickness of a finger, and more than half of what is between two points of an arm that
are looked at, metres: solids are taken for so much larger."""

GAP_M = 0.004
"""How far outside a hand is put that was inside, metres."""

ROUNDS = 6
"""Times that a hand is pushed out of one solid after the other: corners need two or three."""


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """K boxes.

    Attributes:
        centres: (K, 3) world metres.
        rotations: (K, 3, 3) world from a box's axes.
        halves: (K, 3) half extents, metres.
    """

    centres: Array
    rotations: Array
    halves: Array

    def shrunk(self, factor: float) -> Solids:
        """Return them in a unit that is `factor` metres."""
        return Solids(self.centres / factor, self.rotations, self.halves / factor)

    def grown(self, by_m: float) -> Solids:
        """Return them larger on every side."""
        return Solids(self.centres, self.rotations, self.halves + by_m)

    def placed(self, world_from_frame: Pose) -> Solids:
        """Return those of a frame in the world."""
        turn = world_from_frame.rotation
        return Solids(world_from_frame @ self.centres, turn @ self.rotations, self.halves)

    def near(self, points: Array, reach_m: float) -> Solids:
        """Return those that are not further than that from one of the points (N, 3)."""
        far = np.linalg.norm(self.centres[:, None] - points, axis=-1).min(axis=1)
        kept = far < reach_m + np.linalg.norm(self.halves, axis=-1)
        return Solids(self.centres[kept], self.rotations[kept], self.halves[kept])

    def depths(self, points: Array) -> Array:
        """Return (...) how deep points (..., 3) are in the deepest solid, metres; 0 outside."""
        if not len(self.centres):
            return np.zeros(points.shape[:-1])
        local = np.einsum("kji,...kj->...ki", self.rotations, points[..., None, :] - self.centres)
        return np.maximum((self.halves - np.abs(local)).min(axis=-1).max(axis=-1), 0.0)

    def pushes(self, points: Array) -> Array:
        """Return (N, 3) the shift that takes groups of points (N, P, 3) out of the solids.

        Of each solid a group leaves through the face that is the least away; where solids touch, a
        group may need to be pushed again.
        """
        shift = np.zeros((len(points), 3))
        for centre, rotation, half in zip(self.centres, self.rotations, self.halves, strict=True):
            local = (points + shift[:, None] - centre) @ rotation
            inside = (np.abs(local) < half).all(axis=-1)
            if not inside.any():
                continue
            # To leave by +axis the lowest point that is inside decides, by -axis the highest.
            low = np.where(inside[..., None], local, np.inf).min(axis=1)
            high = np.where(inside[..., None], local, -np.inf).max(axis=1)
            ways = np.concatenate([half - low, high + half], axis=1)
            best = np.argmin(ways, axis=1)
            rows = np.flatnonzero(inside.any(axis=1))
            sign = np.where(best[rows] < 3, 1.0, -1.0)
            move = np.zeros((len(points), 3))
            move[rows, best[rows] % 3] = sign * (ways[rows, best[rows]] + GAP_M)
            shift += move @ rotation.T
        return shift


def no_solids() -> Solids:
    """Return none."""
    return Solids(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
