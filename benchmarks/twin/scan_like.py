# pyright: strict
"""A room's exact triangles as a headset would have scanned them: many, small, and noisy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WELD_M = 1e-5
"""Corners nearer than this are one, so that noise opens no crack."""


def scan_like(
    triangles: NDArray[np.float64], *, edge_m: float, noise_m: float, seed: int
) -> NDArray[np.float64]:
    """Triangles (T, 3, 3) halved until no edge is longer than `edge_m`, corners moved.

    An edge is halved or not by its own length, so that neighbours agree and no crack opens.

    Args:
        triangles: world metres, exact.
        edge_m: longest edge of a piece.
        noise_m: standard deviation of a corner's place along each axis.
        seed: of the noise.
    """
    pieces = _halved(triangles, edge_m)
    corners = pieces.reshape(-1, 3)
    # Cuts of neighbours agree to rounding: whatever falls into one small cube is one corner.
    cubes = np.round(corners / WELD_M).astype(np.int64)
    _, index = np.unique(cubes, axis=0, return_inverse=True)
    moved = np.random.default_rng(seed).normal(0.0, noise_m, (int(index.max()) + 1, 3))
    return (corners + moved[index]).reshape(-1, 3, 3)


def block(
    low: tuple[float, float, float], high: tuple[float, float, float], *, is_room: bool = False
) -> NDArray[np.float64]:
    """(12, 3, 3) triangles of an upright box, facing out; of a room, facing in."""
    span = np.subtract(high, low)
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = np.array([half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))])
    return (np.asarray(low) + unit * span)[faces[:, ::-1] if is_room else faces]


def _halved(triangles: NDArray[np.float64], edge_m: float) -> NDArray[np.float64]:
    """Each cut across its longest edge until that is short enough."""
    done: list[NDArray[np.float64]] = []
    left = triangles
    while len(left):
        length = np.linalg.norm(left - np.roll(left, -1, axis=1), axis=2)
        is_short = length.max(axis=1) <= edge_m
        done.append(left[is_short])
        left, length = left[~is_short], length[~is_short]
        # The longest edge runs from the first corner to the second.
        order = (np.argmax(length, axis=1)[:, None] + np.arange(3)) % 3
        left = left[np.arange(len(left))[:, None], order]
        a, b, c = left[:, 0], left[:, 1], left[:, 2]
        middle = 0.5 * (a + b)
        left = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    return np.concatenate(done)
