"""Patches lie in the surface, cover it, and are no thicker than the thing."""

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from sim.physics.collision.depths import BACK_GAP_M, SEAM_M, smooth, with_depths
from sim.physics.collision.grid import Grid, cut_at_grid, grid_along_walls
from sim.physics.collision.patches import CELL_M, DEPTH_M, fit_patches
from sim.physics.collision.surface import surface_of

GRID = Grid(CELL_M, 0.0, (0.03, 0.04, 0.05))


def patches_of(triangles, grid=GRID):
    patches = fit_patches(cut_at_grid(grid.from_world(triangles), grid.cell_m), grid)
    return with_depths(patches, patches)


def distance_to_block(points, low, high):
    """How far points are outside the surface of a block, metres; negative inside."""
    return np.maximum(np.asarray(low) - points, points - np.asarray(high)).max(axis=1)


def test_an_exact_blocks_patches_are_its_faces():
    low, high = (0.0, 0.0, 0.0), (1.0, 0.6, 0.4)
    patches = patches_of(block(low, high))
    assert np.abs(distance_to_block(patches.centre, low, high)).max() < 1e-9
    assert patches.area_m2.sum() == pytest.approx(2 * (0.6 + 0.4 + 0.24), rel=1e-6)
    assert np.abs(patches.normal).max(axis=1) == pytest.approx(np.ones(len(patches)))
    assert patches.depth_m == pytest.approx(np.full(len(patches), DEPTH_M))


def test_normals_look_to_the_free_side():
    patches = patches_of(block((0, 0, 0), (1, 1, 1)))
    outwards = patches.centre - 0.5
    assert (np.sum(patches.normal * outwards, axis=1) > 0).all()
    inside = patches_of(block((0, 0, 0), (3, 3, 3), is_room=True))
    assert (np.sum(inside.normal * (inside.centre - 1.5), axis=1) < 0).all()


def test_a_boards_patches_end_before_its_other_face():
    patches = patches_of(block((0, 0, 0.7), (1.2, 0.6, 0.73)))
    flat = np.abs(patches.normal[:, 2]) > 0.9
    assert patches.depth_m[flat] == pytest.approx(np.full(flat.sum(), 0.03 - BACK_GAP_M))


@pytest.mark.parametrize("seed", range(3))
def test_noise_moves_a_face_by_less_than_itself(seed):
    low, high = (0.0, 0.0, 0.0), (1.5, 1.0, 0.75)
    scan = scan_like(block(low, high), edge_m=0.05, noise_m=0.004, seed=seed)
    patches = patches_of(scan)
    patches = smooth(patches, patches)
    large = patches.area_m2 > 0.02
    assert large.sum() > 50
    off = np.abs(distance_to_block(patches.centre[large], low, high))
    assert np.median(off) < 0.001
    assert off.max() < 0.004
    tilt = np.degrees(np.arccos(np.abs(patches.normal[large]).max(axis=1)))
    assert tilt.max() < 2.5


def test_a_patch_goes_on_where_the_surface_does_and_only_there():
    top = block((0.0, 0.0, 0.0), (1.0, 1.0, 0.5))
    patches = patches_of(top)
    larger = smooth(patches, patches)
    up = larger.normal[:, 2] > 0.9
    reach = larger.centre[up, :2]
    extent = np.abs(
        np.einsum("nka,na->nka", larger.world_from_patch[up][:, :2, :2], larger.half_m[up])
    ).sum(axis=2)
    assert (reach + extent).max() == pytest.approx(1.0, abs=1e-6)
    assert (reach - extent).min() == pytest.approx(0.0, abs=1e-6)
    grown = larger.half_m[up].sum() - patches.half_m[patches.normal[:, 2] > 0.9].sum()
    assert grown > 5 * SEAM_M


def test_a_round_thing_is_covered_by_small_patches():
    angle = np.linspace(0, 2 * np.pi, 49)
    ring = 0.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    a = np.column_stack([ring[:-1], np.zeros(48)])
    b = np.column_stack([ring[1:], np.zeros(48)])
    up = np.array([0.0, 0.0, 0.6])
    drum = np.concatenate([np.stack([a, b, b + up], 1), np.stack([a, b + up, a + up], 1)])
    patches = patches_of(drum)
    radius = np.hypot(patches.centre[:, 0], patches.centre[:, 1])
    assert radius.min() > 0.28
    assert radius.max() < 0.305
    assert patches.area_m2.sum() > 0.9 * 2 * np.pi * 0.3 * 0.6


def test_the_same_surface_gives_the_same_patches():
    scan = scan_like(block((0, 0, 0), (2, 2, 2), is_room=True), edge_m=0.1, noise_m=0.01, seed=2)
    first, second = surface_of(scan).patches, surface_of(scan).patches
    assert (first.centre == second.centre).all()
    assert (first.half_m == second.half_m).all()


def test_a_turned_room_has_no_more_patches_than_a_straight_one():
    furniture = block((0.5, 0.5, 0.3), (1.5, 1.2, 0.8))
    room = np.concatenate([block((0, 0, 0), (4, 3, 2.5), is_room=True), furniture])
    turn = Grid(CELL_M, 0.4, (0.0, 0.0, 0.0)).turn()
    straight = len(patches_of(room, grid_along_walls(room, CELL_M)))
    turned = room @ turn.T
    assert len(patches_of(turned, grid_along_walls(turned, CELL_M))) == pytest.approx(
        straight, rel=0.15
    )
