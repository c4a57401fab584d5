"""Flat quads in the room, and how a picture lies on one: boards, screens, live surfaces, codes.

A picture is spread over a quad by the homography that takes its corners to the quad's, so straight
lines stay straight.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.pose import Pose

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

FLATNESS = 0.05
"""A corner may be this share of the longest side off the plane of the others."""


@dataclass(frozen=True, slots=True)
class QrCode:
    """A printed code on a wall: its payload, side and pose (x right, y up, z out of the wall)."""

    payload: str
    side_m: float
    world_from_code: Pose


@dataclass(frozen=True, slots=True, eq=False)
class Quad:
    """A planar quad, and how a picture lies on it.

    Attributes:
        world_from_plane: origin at the first corner, x along the first side, z away from whoever
            sees the corners run clockwise.
        plane_from_unit: (3, 3) homography from the unit square (x right, y down) to the plane's x
            and y in metres; positive third coordinate where the plane is.
    """

    world_from_plane: Pose
    plane_from_unit: FloatArray

    def points(self, in_unit: ArrayLike) -> tuple[FloatArray, BoolArray]:
        """(N, 2) places, 0..1 across the picture -> (N, 3) world points, (N,) bool on the plane.

        Places outside 0..1 lie beyond the corners; those beyond the quad's horizon are nowhere.
        """
        places = np.asarray(in_unit, dtype=np.float64)
        h = self.plane_from_unit
        mapped = places @ h[:, :2].T + h[:, 2]
        exists = mapped[:, 2] > 1e-6
        flat = mapped[:, :2] / np.where(exists, mapped[:, 2], 1.0)[:, None]
        on_plane = np.concatenate([flat, np.zeros((len(flat), 1))], axis=1)
        return self.world_from_plane @ on_plane, exists

    def places(self, on_plane: ArrayLike) -> FloatArray:
        """(N, 2) places across the picture of (N, 2) points of the plane: inverse of `points`.

        NaN for points that no place of the picture's plane is mapped to.
        """
        flat = np.asarray(on_plane, dtype=np.float64)
        h = np.linalg.inv(self.plane_from_unit)
        mapped = flat @ h[:, :2].T + h[:, 2]
        # What `points` divides by is one over this third coordinate.
        exists = mapped[:, 2] > 0
        return np.where(exists[:, None], mapped[:, :2] / mapped[:, 2:], np.nan)

    def faces(self, eye_in_world: FloatArray) -> bool:
        """Whether an eye is on the side from which the corners run clockwise."""
        return bool((self.world_from_plane.inverse() @ eye_in_world)[2] < 0)


def quad_of(corners_in_world: ArrayLike) -> Quad:
    """The quad of four corners.

    Args:
        corners_in_world: (4, 3) metres, clockwise from the picture's top left.

    Raises:
        ValueError: not four finite corners, not nearly on one plane, or not convex.
    """
    corners = np.asarray(corners_in_world, dtype=np.float64)
    if corners.shape != (4, 3) or not np.isfinite(corners).all():
        raise ValueError(f"surface corners: {corners.tolist()}, wanted four finite (x, y, z)")
    # Newell's normal: twice the area, and the best plane for corners that are not quite on one.
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    longest = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).max())
    area = float(np.linalg.norm(normal))
    if area < 1e-4 * longest * longest or longest < 1e-3:
        raise ValueError(f"surface corners: {corners.tolist()} span no area, wanted a quad")
    z = normal / area
    centre = corners.mean(axis=0)
    off = np.abs((corners - centre) @ z).max()
    if off > FLATNESS * longest:
        raise ValueError(
            f"surface corners: {off:.3f} m off their plane, limit {FLATNESS * longest:.3f} m "
            f"({FLATNESS:.0%} of the longest side): set them anew on one flat surface"
        )
    x = corners[1] - corners[0]
    x = x - z * (x @ z)
    x /= np.linalg.norm(x)
    origin = corners[0] - z * ((corners[0] - centre) @ z)
    axes = np.stack([x, np.cross(z, x), z], axis=1).astype(np.float64)
    world_from_plane = Pose(axes, origin)
    flat = (world_from_plane.inverse() @ corners)[:, :2]
    sides = np.roll(flat, -1, axis=0) - flat
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if (turns <= 1e-6 * longest * longest).any():
        raise ValueError(
            f"surface corners: {corners.tolist()} are no convex quad: set them in order, "
            "clockwise from the top left"
        )
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    plane_from_unit = cv2.getPerspectiveTransform(unit, flat.astype(np.float32))
    return Quad(world_from_plane, np.asarray(plane_from_unit, dtype=np.float64))
