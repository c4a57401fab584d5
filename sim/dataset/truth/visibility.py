"""Pixel counts, boxes and fractions of an object in a picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Seen:
    """An object in a picture.

    Attributes:
        pixels_alone: of its silhouette within the picture.
        pixels_visible: of those, not hidden.
        box_alone: x0, y0, x1, y1 in pixels, the last two exclusive; None outside the picture.
        box_visible: likewise of what is not hidden.
    """

    pixels_alone: int
    pixels_visible: int
    box_alone: tuple[int, int, int, int] | None
    box_visible: tuple[int, int, int, int] | None

    @property
    def fraction(self) -> float:
        """0..1: visible over alone; 0 outside the picture."""
        return self.pixels_visible / self.pixels_alone if self.pixels_alone else 0.0


OUTSIDE = Seen(0, 0, None, None)
"""An object that is not in the picture."""


def seen(alone: NDArray[np.bool_], visible: NDArray[np.bool_], corner: tuple[int, int]) -> Seen:
    """Counts of two masks of the same part of a picture.

    Args:
        alone: (h, w) silhouette.
        visible: (h, w) what is not hidden of it.
        corner: (x, y) pixel of the part's first column and row.
    """
    return Seen(
        int(np.count_nonzero(alone)),
        int(np.count_nonzero(visible)),
        box_of(alone, corner),
        box_of(visible, corner),
    )


def box_of(
    mask: NDArray[np.bool_], corner: tuple[int, int] = (0, 0)
) -> tuple[int, int, int, int] | None:
    """x0, y0, x1, y1 (exclusive) around what is set; None if nothing is."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return None
    x, y = corner
    return (
        x + int(columns[0]), y + int(rows[0]), x + int(columns[-1]) + 1, y + int(rows[-1]) + 1,
    )  # fmt: skip
