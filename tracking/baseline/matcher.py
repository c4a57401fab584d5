# pyright: standard
"""Corresponding points of two pictures: the `Matcher` protocol and one that needs no weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

RATIO_TEST = 0.8
"""A match must be this much nearer than the second nearest."""

SMALL_SIDE_PX = 160
"""Pictures smaller than this are doubled first: SIFT finds nothing in a 60 px chair."""


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Corresponding points of two pictures.

    Attributes:
        first: (M, 2) pixels.
        second: (M, 2) pixels.
    """

    first: NDArray[np.float64]
    second: NDArray[np.float64]


class Matcher(Protocol):
    """Finds corresponding points of two pictures of one object."""

    def match(self, first: NDArray[np.uint8], second: NDArray[np.uint8]) -> Matches:
        """Points of two (H, W, 3) RGB pictures of the same size."""
        ...


class SiftMatcher:
    """SIFT with a ratio test and mutual neighbours; stands in for SuperPoint + LightGlue."""

    def match(self, first: NDArray[np.uint8], second: NDArray[np.uint8]) -> Matches:
        """Points of two (H, W, 3) RGB pictures."""
        scale = 2.0 if min(first.shape[:2]) < SMALL_SIDE_PX else 1.0
        sift = cv2.SIFT.create(contrastThreshold=0.01)
        key_a, a = sift.detectAndCompute(_grey(first, scale), None)  # pyright: ignore
        key_b, b = sift.detectAndCompute(_grey(second, scale), None)  # pyright: ignore
        if a is None or b is None or len(a) < 2 or len(b) < 2:
            return Matches(np.zeros((0, 2)), np.zeros((0, 2)))
        apart = 2.0 - 2.0 * _unit(np.asarray(a, np.float32)) @ _unit(np.asarray(b, np.float32)).T
        nearest = np.argmin(apart, axis=1)
        rows = np.arange(len(a))
        second_best = np.partition(apart, 1, axis=1)[:, 1]
        mutual = np.argmin(apart, axis=0)[nearest] == rows
        good = mutual & (apart[rows, nearest] < RATIO_TEST**2 * second_best)
        first_px = np.array([key_a[i].pt for i in rows[good]]).reshape(-1, 2) / scale
        second_px = np.array([key_b[j].pt for j in nearest[good]]).reshape(-1, 2) / scale
        return Matches(first_px, second_px)


def _grey(image: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    if scale != 1.0:
        grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
    return np.asarray(grey, dtype=np.uint8)


def _unit(descriptors: NDArray[np.float32]) -> NDArray[np.float32]:
    return descriptors / np.maximum(np.linalg.norm(descriptors, axis=1, keepdims=True), 1e-9)
