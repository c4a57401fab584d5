"""What an object's pixels look like: a soft colour histogram that tolerates light and exposure."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.splats import SplatCloud

BINS = 24
"""Bins per channel."""

LIGHT_FACTORS = (0.45, 0.55, 0.66, 0.78, 0.9, 1.0, 1.1, 1.22)
"""An object may be this much darker or lighter than in its scan: turned from the light, shaded."""


@dataclass(frozen=True, slots=True, eq=False)
class ColourModel:
    """How like an object's scan a colour is.

    Attributes:
        table: (BINS, BINS, BINS) float32 by R, G, B; 1 for the object's most usual colours, 0 for
            colours it doesn't have.
    """

    table: NDArray[np.float32]

    @staticmethod
    def of_splats(splats: SplatCloud) -> ColourModel:
        """From the splats' base colours, weighted by their area and opacity."""
        area = np.sort(splats.scales, axis=1)[:, 1:].prod(axis=1)
        weight = (splats.opacities * area).astype(np.float64)
        colours = np.clip(splats.colours().astype(np.float64), 0.0, 1.0)
        table = np.zeros((BINS, BINS, BINS))
        for factor in LIGHT_FACTORS:
            index = _bins(np.clip(colours * factor, 0.0, 1.0))
            np.add.at(table, tuple(index.T), weight)
        for axis in range(3):
            table = _blur(table, axis)
        # The rare colour of a small part counts nearly as much as that of the large ones.
        table = np.minimum(table / (0.02 * table.sum() / len(LIGHT_FACTORS)), 1.0)
        table = table.astype(np.float32)
        table.setflags(write=False)
        return ColourModel(table)

    def likeness(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """(..., 3) uint8 RGB -> (...) float32, 0..1."""
        index = image.astype(np.uint16) * BINS >> 8
        return self.table[index[..., 0], index[..., 1], index[..., 2]]


def _bins(colours: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.minimum((colours * BINS).astype(np.int64), BINS - 1)


def _blur(table: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    moved = np.moveaxis(table, axis, -1)
    shape = moved.shape
    flat = np.ascontiguousarray(moved.reshape(-1, shape[-1]))
    blurred = cv2.GaussianBlur(flat, (5, 1), 0.8, borderType=cv2.BORDER_REPLICATE)
    return np.moveaxis(blurred.reshape(shape), -1, axis)
