"""How far the tracker was off, by place on the floor: numbers for the page and for the view."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.evaluate.scores import ScoreBoard

CELL_M = 0.25
"""Side of a cell of the map, chosen: half a chair."""

MIN_RANGE_CM = 2.0
"""Smallest end of the colour scales, so that millimetres don't look like faults."""


def cells_of(footprint_m: NDArray[Any]) -> tuple[int, int]:
    """Rows (y) and columns (x) of cells that cover a floor, given its corners (2, 2), metres."""
    low, high = footprint_m
    columns, rows = np.ceil((high - low) / CELL_M - 1e-9).astype(int)
    return int(rows), int(columns)


def mean_errors(
    board: ScoreBoard, low: NDArray[Any], shape: tuple[int, int]
) -> NDArray[np.float64]:
    """(rows, columns) mean position error in cm where objects truly were; NaN where none was.

    Args:
        board: of one run.
        low: (2,) corner of the first cell, world metres.
        shape: rows (y) and columns (x) of cells.
    """
    total, count = np.zeros(shape), np.zeros(shape)
    for object_id in board.object_ids():
        for sample in board.samples(object_id):
            if not sample.counted:
                continue
            place = sample.true_world_from_object.translation[:2]
            column, row = np.floor((place - low) / CELL_M).astype(int)
            if 0 <= row < shape[0] and 0 <= column < shape[1]:
                total[row, column] += sample.error.world_cm
                count[row, column] += 1
    return np.divide(total, count, out=np.full(shape, np.nan), where=count > 0)
