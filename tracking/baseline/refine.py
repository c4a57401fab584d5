# pyright: standard
"""Fine pose of the paper's optimiser: Powell on the contour Chamfer distance (paper eq. 4)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import scipy.optimize
from numpy.typing import NDArray

YAW_BOUND = math.radians(22.5)
XY_BOUND_M = 0.05
Z_BOUND_M = 0.5
"""Bounds around the start (paper): beside the ray to the object, along it, about up."""

MAX_DRAWINGS = 200
"""The paper's budget of 1 s at 4 ms a drawing, less the keypoint stage."""

NOTHING_DRAWN = 1e6
"""Loss of a pose whose picture is empty."""


@dataclass(frozen=True, slots=True, eq=False)
class ObservedContour:
    """The contour of a mask, ready to be compared with many others.

    Attributes:
        pixels: (N, 2) int (x, y) of the contour.
        distance: (H, W) float32 distance of every pixel to the contour.
    """

    pixels: NDArray[np.int64]
    distance: NDArray[np.float32]


def contour_pixels(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(N, 2) pixels (x, y) on all outlines of a mask, OpenCV's border following."""
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    if not found:
        return np.zeros((0, 2), np.int64)
    return np.concatenate([c.reshape(-1, 2) for c in found]).astype(np.int64)


def observe_contour(mask: NDArray[np.bool_]) -> ObservedContour:
    """The contour of a (H, W) mask with its distance map."""
    pixels = contour_pixels(mask)
    return ObservedContour(pixels, distance_to(pixels, mask.shape))


def distance_to(pixels: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """(H, W) float32 Euclidean distance of every pixel to the nearest of (N, 2) pixels."""
    canvas = np.full(shape[:2], 255, np.uint8)
    canvas[pixels[:, 1], pixels[:, 0]] = 0
    return np.asarray(
        cv2.distanceTransform(canvas, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), dtype=np.float32
    )


def chamfer(projected: NDArray[np.int64], observed: ObservedContour) -> float:
    """Symmetric mean squared nearest-neighbour distance in px² (paper eq. 4).

    Args:
        projected: (N, 2) contour pixels of the drawn object.
        observed: of the live object, in a picture of the same size.
    """
    if len(projected) == 0 or len(observed.pixels) == 0:
        return NOTHING_DRAWN
    forth = observed.distance[projected[:, 1], projected[:, 0]]
    back_map = distance_to(projected, observed.distance.shape)
    back = back_map[observed.pixels[:, 1], observed.pixels[:, 0]]
    return float((forth.astype(np.float64) ** 2).mean() + (back.astype(np.float64) ** 2).mean())


def minimise_chamfer(
    start: NDArray[np.float64],
    observed: ObservedContour,
    draw_mask: Callable[[NDArray[np.float64]], NDArray[np.bool_]],
) -> tuple[NDArray[np.float64], float]:
    """SciPy's Powell within the paper's bounds.

    Args:
        start: (4,) metres right of and below the ray to the object, its depth, yaw in radians.
        observed: contour of the live object.
        draw_mask: draws the object's mask at such a vector.

    Returns:
        The best vector (4,) and its loss in px².
    """
    bound = np.array([XY_BOUND_M, XY_BOUND_M, Z_BOUND_M, YAW_BOUND])

    def loss(vector: NDArray[np.float64]) -> float:
        return chamfer(contour_pixels(draw_mask(vector)), observed)

    result = scipy.optimize.minimize(
        loss,
        start,
        method="Powell",
        bounds=list(zip(start - bound, start + bound, strict=True)),
        options={"maxfev": MAX_DRAWINGS, "xtol": 1e-3, "ftol": 1e-3},
    )
    return np.asarray(result.x, dtype=np.float64), float(result.fun)
