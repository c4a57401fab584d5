"""A room that has a box on its floor, made of flat splats laid a step apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from scenes.splats import SplatCloud

Laid = Callable[..., SplatCloud]
BoxOnFloor = Callable[..., tuple[SplatCloud, SplatCloud]]
COLOUR_OF_BOX, COLOUR_OF_FLOOR = (0.7, 0.25, 0.2), (0.7, 0.65, 0.6)


def flat(points, thin, colour, *, step_m, opacity=0.95) -> SplatCloud:
    """Splats at points (N, 3), thin along one axis and wide enough to close the gaps."""
    n = len(points)
    scales = np.full((n, 3), 0.7 * step_m)
    scales[np.arange(n), thin] = 0.001
    sh = np.tile((np.asarray(colour, dtype=np.float32) - 0.5) / 0.2820948, (n, 1, 1))
    turns = np.tile([1.0, 0, 0, 0], (n, 1))
    return SplatCloud(points, scales, turns, np.full(n, opacity), sh)


def grid(low, high, axis, at, *, step_m) -> np.ndarray:
    """Points a step apart on a rectangle across an axis."""
    lines = [np.arange(low[a] + step_m / 2, high[a], step_m) for a in range(3)]
    lines[axis] = np.array([at])
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.fixture(scope="session")
def flat_splats() -> Laid:
    return flat


@pytest.fixture(scope="session")
def box_on_floor() -> BoxOnFloor:
    """Makes a floor that was never seen under the box, and a box with all its six faces."""

    def made(size_m, *, floor_m: float, step_m: float) -> tuple[SplatCloud, SplatCloud]:
        size = np.asarray(size_m, dtype=np.float64)
        low, high = -0.5 * size * (1, 1, 0), 0.5 * size * (1, 1, 2)
        level = grid((-floor_m, -floor_m, 0), (floor_m, floor_m, 0), 2, 0.0, step_m=step_m)
        under = ((level > low) & (level < high))[:, :2].all(axis=1)
        faces, thin = [], []
        for axis in range(3):
            for end in (low, high):
                faces.append(grid(low, high, axis, end[axis], step_m=step_m))
                thin.append(np.full(len(faces[-1]), axis))
        box = flat(np.concatenate(faces), np.concatenate(thin), COLOUR_OF_BOX, step_m=step_m)
        return flat(level[~under], 2, COLOUR_OF_FLOOR, step_m=step_m), box

    return made
