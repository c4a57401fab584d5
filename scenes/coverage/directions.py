"""A sphere of directions in 64 cells of one area, so that a set of directions is 64 bits.

Cells lie in level rings whose counts are multiples of four, mirrored at the equator: a quarter turn
about up maps them onto each other exactly, and so does standing on one's head.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Bits = NDArray[np.uint64]

RINGS = (4, 12, 16, 16, 12, 4)
"""Cells of each ring, from the highest: chosen so that cells are about as wide as high. With one
area each they end at the heights 1, 7/8, 1/2, 0, -1/2, -7/8 and -1 of the unit sphere."""

DIRECTIONS = sum(RINGS)
"""Cells, one for each bit of a word."""

_STARTS = np.concatenate([[0], np.cumsum(RINGS)])
"""First cell of each ring, and the end of the last."""

_HEIGHTS = 1.0 - 2.0 * _STARTS / DIRECTIONS
"""Heights between the rings, from 1 to -1: a zone of the unit sphere has the area of its height."""


def cells_of_directions(towards: NDArray[np.floating]) -> NDArray[np.intp]:
    """(N,) cell of each direction (N, 3) of any length, 0 to 63; straight up for no direction."""
    vectors = np.atleast_2d(np.asarray(towards, dtype=np.float64))
    length = np.linalg.norm(vectors, axis=1)
    height = np.where(length > 0.0, vectors[:, 2] / np.maximum(length, 1e-300), 1.0)
    # A direction on the border of two rings is the upper one's.
    ring = np.clip(np.searchsorted(-_HEIGHTS, -height, side="left") - 1, 0, len(RINGS) - 1)
    count = np.array(RINGS)[ring]
    turn = np.arctan2(vectors[:, 1], vectors[:, 0]) / (2.0 * math.pi) % 1.0
    column = np.minimum((turn * count).astype(np.intp), count - 1)
    return _STARTS[ring] + column


def middles() -> FloatArray:
    """(64, 3) unit directions of the cells' middles."""
    found: list[FloatArray] = []
    for ring, count in enumerate(RINGS):
        height = 0.5 * (_HEIGHTS[ring] + _HEIGHTS[ring + 1])
        turn = 2.0 * math.pi * (np.arange(count) + 0.5) / count
        level = math.sqrt(1.0 - height**2)
        found.append(
            np.column_stack([level * np.cos(turn), level * np.sin(turn), np.full(count, height)])
        )
    return np.concatenate(found)


def bits_of(towards: NDArray[np.floating]) -> Bits:
    """(N,) words with the bit of each direction's cell alone."""
    return np.left_shift(np.uint64(1), cells_of_directions(towards).astype(np.uint64))


def bits_within(towards: NDArray[np.floating], reach_rad: float) -> Bits:
    """(N,) words with the bit of each direction's cell, and of all with a middle that near.

    Args:
        towards: (N, 3) directions of any length.
        reach_rad: angle between the direction and a cell's middle, radians.
    """
    vectors = np.atleast_2d(np.asarray(towards, dtype=np.float64))
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    near = unit @ middles().T >= math.cos(reach_rad)
    return bits_of(vectors) | packed(near)


def packed(flags: NDArray[np.bool_]) -> Bits:
    """(N,) words of flags (N, 64), the first the lowest bit."""
    weights = np.left_shift(np.uint64(1), np.arange(DIRECTIONS, dtype=np.uint64))
    return np.where(flags, weights, np.uint64(0)).sum(axis=1, dtype=np.uint64)


def unpacked(words: Bits) -> NDArray[np.bool_]:
    """(N, 64) flags of words (N,), the lowest bit first."""
    places = np.arange(DIRECTIONS, dtype=np.uint64)
    return (np.right_shift(words[:, None], places) & np.uint64(1)).astype(np.bool_)
