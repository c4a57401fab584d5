"""The tracker's error by place, as coloured squares on the floor of the view."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.package import ScenePackage
from studio.app.viewport.drawing.shapes import Colour, Squares

HEIGHT_M = 0.012
"""Of the squares above the floor, metres: a scan's floor is rough by about this."""

OPACITY = 0.62
"""Of the squares: the floor's pattern stays visible below."""

GAP = 0.04
"""Share of a square's side that is left free on each side: cells can be counted."""

STOPS: tuple[Colour, ...] = (
    (0.267, 0.005, 0.329),
    (0.231, 0.322, 0.545),
    (0.129, 0.569, 0.549),
    (0.369, 0.788, 0.384),
    (0.992, 0.906, 0.145),
)
"""Viridis at 0, 1/4 … 1: equal steps look equal, also to whoever does not tell red from green."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorErrors:
    """A session's tracking error by cell of the floor.

    Attributes:
        squares: what is drawn; no square where no object ever was.
        top_m: error at the end of the colour scale, metres.
        worst_m: largest mean error of a cell, metres.
    """

    squares: Squares
    top_m: float
    worst_m: float


def floor_errors(recording: Path, scene: ScenePackage) -> FloorErrors:
    """Mean position error of the objects that moved, where they truly were.

    Raises:
        ValueError: the recording is damaged, has no truth, or nothing moved in it.
        OSError: it cannot be read.
    """
    from studio.compare.floor_cells import CELL_M, cells_of, mean_errors
    from studio.compare.run import read_board

    low = scene.footprint_m[0]
    board = read_board(recording, scene)
    means_m = 0.01 * mean_errors(board, low, cells_of(scene.footprint_m))
    if not np.isfinite(means_m).any():
        raise ValueError(
            f"{recording}: no errors to draw on the floor: the session has no true poses, or no "
            "object has moved; rehearse a scenario that moves something"
        )
    return drawn_cells(means_m, low, cell_m=CELL_M)


def drawn_cells(
    means_m: NDArray[np.float64], low: NDArray[np.float64], *, cell_m: float
) -> FloorErrors:
    """Squares of a map.

    Args:
        means_m: (rows along y, columns along x) mean errors, metres; NaN is left free.
        low: (2,) corner of the first cell, world metres.
        cell_m: side of a cell.
    """
    from studio.compare.floor_cells import MIN_RANGE_CM

    rows, columns = np.nonzero(np.isfinite(means_m))
    values = means_m[rows, columns]
    worst_m = float(values.max())
    top_m = max(0.01 * MIN_RANGE_CM, worst_m)
    unit = np.array([[GAP, GAP], [1 - GAP, GAP], [1 - GAP, 1 - GAP], [GAP, 1 - GAP]])
    flat = low + cell_m * (np.stack([columns, rows], axis=1)[:, None, :] + unit)
    height = np.full((len(flat), 4, 1), HEIGHT_M)
    corners = np.concatenate([flat, height], axis=2)
    return FloorErrors(
        Squares("floor errors", corners, colours_of(values / top_m), OPACITY), top_m, worst_m
    )


def colours_of(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) colours 0..1 of shares (N,) of the scale, 0..1."""
    ends = np.linspace(0.0, 1.0, len(STOPS))
    stops = np.array(STOPS)
    return np.stack([np.interp(shares, ends, stops[:, c]) for c in range(3)], axis=1)
