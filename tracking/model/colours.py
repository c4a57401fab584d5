"""Colour model of an object: a soft colour histogram that tolerates light and exposure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

BINS = 24
"""Bins per channel."""

LIGHT_FACTORS = (0.6, 0.68, 0.76, 0.84, 0.92, 1.0, 1.1, 1.2)
"""An object where it was scanned may be this much darker or lighter: turned from the light, shaded.
Chosen on the rooms lab and desk."""

ANY_LIGHT_FACTORS = tuple(0.5 * 2.0 ** (k / 5) for k in range(11))
"""The same of an object anywhere in a room: two standard deviations of the gains that were fitted
in a foreign room, in steps of a bin. Wider still, more of the room would pass for its own."""

OWN_SHARE = 0.15
"""All but this share of an object's own pixels have colour similarity 1."""


@dataclass(frozen=True, slots=True, eq=False)
class ColourModel:
    """Colour similarity to an object's scan.

    Attributes:
        table: (BINS, BINS, BINS) float32 by R, G, B; 1 for the object's most frequent colours, 0
            for colours it does not have.
    """

    table: NDArray[np.float32]

    @staticmethod
    def of_pixels(
        colours: NDArray[np.floating], light_factors: Sequence[float] = LIGHT_FACTORS
    ) -> ColourModel:
        """From (N, 3) colours 0..1 of an object's pictures, mixed as a camera mixes them."""
        colours = np.clip(np.asarray(colours, dtype=np.float64), 0.0, 1.0)
        table = np.zeros((BINS, BINS, BINS))
        for factor in light_factors:
            index = _bins(np.clip(colours * factor, 0.0, 1.0))
            np.add.at(table, tuple(index.T), 1.0)
        for axis in range(3):
            table = _blur(table, axis)
        own = table[tuple(_bins(colours).T)]
        table = np.minimum(table / max(float(np.quantile(own, OWN_SHARE)), 1e-9), 1.0)
        table = table.astype(np.float32)
        table.setflags(write=False)
        return ColourModel(table)

    def colour_similarity(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """(..., 3) uint8 RGB -> (...) float32 similarity, 0..1."""
        index = image.astype(np.uint16) * BINS >> 8
        return self.table[index[..., 0], index[..., 1], index[..., 2]]


def _bins(colours: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.minimum((colours * BINS).astype(np.int64), BINS - 1)


def _blur(table: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    moved = np.moveaxis(table, axis, -1)
    shape = moved.shape
    flat = np.ascontiguousarray(moved.reshape(-1, shape[-1]))
    blurred = cv2.GaussianBlur(flat, (5, 1), 0.8, borderType=cv2.BORDER_REPLICATE)
    return np.moveaxis(np.asarray(blurred, dtype=np.float64).reshape(shape), -1, axis)
