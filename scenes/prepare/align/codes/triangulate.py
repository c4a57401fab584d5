# pyright: standard
"""A first place for a printed square, from a few photos among which some may be wrong."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.align.similarity import Similarity, similarity_from_points
from scenes.prepare.reconstruction import View

FloatArray = NDArray[np.float64]

UNIT_CORNERS = np.array([[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, -0.5, 0.0]])
"""Corners of a code of side 1 in its own frame (x right, y up, z out of the wall)."""

INLIER_PX = 4.0
"""A photo whose corners are this near to the prediction (root mean square) belongs to the place."""

MIN_ANGLE_DEG = 1.0
"""Rays that cross at a smaller angle, degrees, do not constrain depth."""

MAX_PAIRS = 400
"""Pairs of views tried as hypotheses, evenly out of all."""


@dataclass(frozen=True, slots=True, eq=False)
class Square:
    """A square in a reconstruction: where it is and which photos say so.

    Attributes:
        reconstruction_from_code: of a code of side 1; its scale is the side in the
            reconstruction's units.
        is_inlier: (V,) bool, one a photo.
        angle_deg: the widest angle between two rays to its centre.
    """

    reconstruction_from_code: Similarity
    is_inlier: NDArray[np.bool_]
    angle_deg: float


def rays(view: View, pixels: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The camera's place (3,) and (N, 3) unit directions in the reconstruction."""
    return (
        view.world_from_camera.translation,
        view.camera.unproject(pixels) @ view.world_from_camera.rotation.T,
    )


def triangulated(origins: FloatArray, directions: FloatArray) -> FloatArray:
    """The point nearest to all rays (least squares of distances).

    Args:
        origins: (N, 3).
        directions: (N, 3) unit vectors, not all parallel.
    """
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    return np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, origins))


def predicted_corners(square: Similarity, view: View) -> FloatArray | None:
    """(4, 2) px of the square in a photo; None if it is behind, outside or seen from its back."""
    corners = square @ UNIT_CORNERS
    towards = view.world_from_camera.translation - square.translation
    if float(towards @ square.rotation[:, 2]) <= 0:
        return None
    pixels, valid = view.camera.project(view.world_from_camera.inverse() @ corners)
    return pixels if bool(valid.all()) else None


def find_square(views: Sequence[View], corners_px: Sequence[FloatArray]) -> Square | None:
    """The square that most photos agree on.

    Every pair of photos (of many, an even choice) proposes a square; the one with most agreement
    is fitted again to all that agree.

    Args:
        views: the photos that show the code.
        corners_px: (4, 2) corners in each.

    Returns:
        None if no two photos are far enough apart or agree.
    """
    cast = [rays(view, pixels) for view, pixels in zip(views, corners_px, strict=True)]
    places = np.stack([place for place, _ in cast]) if cast else np.zeros((0, 3))
    directions = np.stack([direction for _, direction in cast]) if cast else np.zeros((0, 4, 3))
    pairs = [
        pair
        for pair in itertools.combinations(range(len(views)), 2)
        if _angle_deg(directions[pair[0], 0], directions[pair[1], 0]) >= MIN_ANGLE_DEG
    ]
    pairs = pairs[:: max(1, math.ceil(len(pairs) / MAX_PAIRS))]
    best: NDArray[np.bool_] | None = None
    best_cost = math.inf
    for pair in pairs:
        square = _fit(places, directions, list(pair))
        if square is None:
            continue
        errors = _errors_px(square, views, corners_px)
        is_inlier = errors < INLIER_PX
        if is_inlier[list(pair)].all():
            cost = float(np.minimum(errors, INLIER_PX).sum())
            if cost < best_cost:
                best, best_cost = is_inlier, cost
    if best is None:
        return None
    chosen = np.flatnonzero(best).tolist()
    square = _fit(places, directions, chosen)
    if square is None:
        return None
    is_inlier = _errors_px(square, views, corners_px) < INLIER_PX
    centre = directions[is_inlier].mean(axis=1)
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    angle = math.degrees(math.acos(float(np.clip((centre @ centre.T).min(initial=1.0), -1, 1))))
    return Square(square, is_inlier, angle)


def _fit(places: FloatArray, directions: FloatArray, chosen: list[int]) -> Similarity | None:
    try:
        corners = np.stack([triangulated(places[chosen], directions[chosen, k]) for k in range(4)])
        square = similarity_from_points(corners, UNIT_CORNERS)
    except (ValueError, np.linalg.LinAlgError):
        return None
    return square


def _errors_px(
    square: Similarity, views: Sequence[View], corners_px: Sequence[FloatArray]
) -> FloatArray:
    errors = np.full(len(views), np.inf)
    for k, (view, seen) in enumerate(zip(views, corners_px, strict=True)):
        predicted = predicted_corners(square, view)
        if predicted is not None:
            errors[k] = math.sqrt(float(((predicted - seen) ** 2).sum(axis=1).mean()))
    return errors


def _angle_deg(a: FloatArray, b: FloatArray) -> float:
    return math.degrees(math.acos(float(np.clip(a @ b, -1.0, 1.0))))
