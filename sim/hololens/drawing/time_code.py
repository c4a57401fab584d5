"""A time burnt into a picture as black and white blocks, which any codec leaves readable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BLOCK_PX = 8
"""Side of a block: that of a codec's transform."""

BITS, ROWS = 48, 2
"""Blocks, and rows that they fill: microseconds of nine years in 192 × 16 pixels."""

DARK, LIGHT = 16, 235
"""Grey values of the blocks, within any codec's range."""


def burn(picture: NDArray[np.uint8], t_us: int) -> None:
    """Write a time, microseconds, over the top left corner of a (H, W, 3) picture."""
    bits = (t_us >> np.arange(BITS - 1, -1, -1)) & 1
    cells = np.where(bits, LIGHT, DARK).astype(np.uint8).reshape(ROWS, BITS // ROWS)
    blocks = np.kron(cells, np.ones((BLOCK_PX, BLOCK_PX), np.uint8))
    picture[: blocks.shape[0], : blocks.shape[1]] = blocks[:, :, None]


def burnt_us(grey: NDArray[np.uint8]) -> int | None:
    """Return the time in a grey picture (H, W); None where a block is neither black nor white."""
    height, width = ROWS * BLOCK_PX, BITS // ROWS * BLOCK_PX
    if grey.shape[0] < height or grey.shape[1] < width:
        return None
    blocks = grey[:height, :width].reshape(ROWS, BLOCK_PX, BITS // ROWS, BLOCK_PX)
    means = blocks[:, 2:-2, :, 2:-2].mean(axis=(1, 3)).ravel()
    if np.any((means > 90) & (means < 160)):
        return None
    return int("".join("1" if mean > 125 else "0" for mean in means), 2)
