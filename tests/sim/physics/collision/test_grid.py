"""Cutting at a grid keeps the surface, and no surface lies on a boundary."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from benchmarks.twin.scan_like import block
from sim.physics.collision.grid import (
    Grid,
    area_vectors,
    cells_of,
    cut_at_grid,
    grid_along_walls,
)

CELL_M = 0.25


@given(arrays(np.float64, (5, 3, 3), elements=st.floats(-1.5, 1.5, width=32)))
def test_pieces_lie_in_one_cell_and_have_the_area_and_the_direction(triangles):
    pieces = cut_at_grid(triangles, CELL_M)
    low = CELL_M * cells_of(pieces, CELL_M)[:, None]
    assert (pieces >= low - 1e-6).all()
    assert (pieces <= low + CELL_M + 1e-6).all()
    assert area_vectors(pieces).sum(axis=0) == pytest.approx(
        area_vectors(triangles).sum(axis=0), abs=1e-5
    )
    areas = np.linalg.norm(area_vectors(triangles), axis=1)
    assert np.linalg.norm(area_vectors(pieces), axis=1).sum() == pytest.approx(
        areas.sum(), abs=1e-5
    )


@pytest.mark.parametrize("yaw_deg", [-40.0, -3.0, 0.0, 20.0, 44.0])
def test_cells_run_along_the_walls(yaw_deg):
    turn = Grid(CELL_M, math.radians(yaw_deg), (0.0, 0.0, 0.0)).turn()
    room = block((0, 0, 0), (4, 3, 2.5), is_room=True) @ turn.T
    assert math.degrees(grid_along_walls(room, CELL_M).yaw) == pytest.approx(yaw_deg, abs=1e-6)


def test_no_wall_lies_on_a_boundary_of_cells():
    # Every side is a whole number of cells long.
    room = block((0, 0, 0), (4, 3, 2.5), is_room=True)
    grid = grid_along_walls(room, CELL_M)
    corners = grid.from_world(room.reshape(-1, 3)) / CELL_M
    assert np.abs(corners - np.round(corners)).min() > 0.02


def test_there_and_back():
    grid = Grid(CELL_M, 0.3, (0.1, 0.2, 0.05))
    points = np.random.default_rng(1).normal(size=(7, 3))
    assert grid.to_world(grid.from_world(points)) == pytest.approx(points)
