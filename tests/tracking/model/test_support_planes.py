"""Surfaces to stand on in a room with a table."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.splats import SplatCloud, concatenate
from tracking.model.support_planes import support_planes_in

TABLE_M = 0.7


def flat(x, y, z, *, step=0.05, scale=0.03, opacity=0.9):
    """Flat splats over a rectangle at a height."""
    grid = np.meshgrid(np.arange(*x, step), np.arange(*y, step))
    means = np.stack([grid[0].ravel(), grid[1].ravel(), np.full(grid[0].size, z)], axis=1)
    count = len(means)
    return SplatCloud(
        means.astype(np.float32),
        np.tile(np.array([scale, scale, 0.001], np.float32), (count, 1)),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, opacity, np.float32),
        np.zeros((count, 1, 3), np.float32),
    )


def a_thing(x, y, z, side_m=0.2):
    return SimpleNamespace(
        support_z_m=z, world_from_object=Pose.from_yaw(0.0, (x, y, z)), box_m=(side_m, side_m, 0.1)
    )


def contains(stands, *place):
    return bool(stands.can_hold(np.array([place], dtype=np.float64))[0])


@pytest.fixture(scope="module")
def stands():
    """A table of 1.2 m by 0.8 m, scanned with a thing on it."""
    return support_planes_in(flat((0, 1.2), (0, 0.8), TABLE_M + 0.01), [a_thing(0.6, 0.4, TABLE_M)])


def test_things_stand_on_the_table_and_not_beside_it(stands):
    assert contains(stands, 0.3, 0.3, TABLE_M)
    assert contains(stands, 1.0, 0.6, TABLE_M)
    assert not contains(stands, 1.6, 0.3, TABLE_M)
    assert not contains(stands, 0.3, -0.4, TABLE_M)


def test_the_floor_is_everywhere_even_outside_the_maps(stands):
    assert contains(stands, 1.6, 0.3, 0.0)
    assert contains(stands, 50.0, -50.0, 0.01)
    assert not contains(stands, 50.0, -50.0, TABLE_M)


def test_heights_that_are_one_are_taken_once():
    things = [a_thing(0, 0, TABLE_M), a_thing(1, 0, TABLE_M + 0.004), a_thing(2, 0, 0.5)]
    assert support_planes_in(flat((0, 1), (0, 1), 0.0), things).heights_m == (0.0, 0.5, TABLE_M)


def test_a_bare_place_where_a_thing_stood_is_of_the_table():
    left, right = (flat(x, (0, 0.8), TABLE_M) for x in ((0, 0.5), (0.7, 1.2)))
    room = SplatCloud(
        *(
            np.concatenate([getattr(left, name), getattr(right, name)])
            for name in ("means", "scales", "rotations", "opacities", "sh")
        )
    )
    assert contains(support_planes_in(room, [a_thing(0.2, 0.2, TABLE_M)]), 0.6, 0.4, TABLE_M)


def test_a_wall_s_top_and_haze_are_no_stands():
    wall = flat((0, 3), (0, 0.06), TABLE_M)
    physical = a_thing(1.0, 2.0, TABLE_M)
    assert not contains(support_planes_in(wall, [physical]), 2.0, 0.03, TABLE_M)
    haze = flat((0, 1.2), (0, 0.8), TABLE_M, scale=0.3)
    assert not contains(support_planes_in(haze, [physical]), 0.3, 0.3, TABLE_M)


def test_where_a_thing_was_scanned_it_can_stand_whatever_the_room_shows():
    stands = support_planes_in(flat((0, 1), (0, 1), 0.0), [a_thing(2.0, 2.0, TABLE_M)])
    assert contains(stands, 2.05, 1.95, TABLE_M)
    assert not contains(stands, 2.5, 2.0, TABLE_M)


def test_a_level_surface_is_a_support_plane_though_nothing_stood_on_it():
    stands = support_planes_in(flat((0, 1.2), (0, 0.8), TABLE_M), [a_thing(2, 0, 0.0)])
    assert stands.heights_m == pytest.approx((0.0, TABLE_M), abs=0.001)
    assert contains(stands, 0.6, 0.4, TABLE_M)
    assert not contains(stands, 1.6, 0.4, TABLE_M)


def test_the_lower_side_of_a_board_is_no_support_plane():
    board = concatenate([flat((0, 1.2), (0, 0.8), z) for z in (TABLE_M - 0.03, TABLE_M)])
    stands = support_planes_in(board, [a_thing(2, 0, 0.0)])
    assert stands.heights_m == pytest.approx((0.0, TABLE_M), abs=0.001)


def test_what_is_narrow_steep_or_out_of_reach_is_no_support_plane():
    narrow = flat((0, 1.2), (0, 0.05), 0.5)
    steep = flat((0, 1.2), (0, 0.8), 0.9)
    steep = SplatCloud(
        steep.means, steep.scales[:, ::-1].copy(), steep.rotations, steep.opacities, steep.sh
    )
    ceiling = flat((0, 1.2), (0, 0.8), 2.4)
    room = concatenate([narrow, steep, ceiling])
    assert support_planes_in(room, [a_thing(2, 0, 0.0)]).heights_m == (0.0,)
