"""Free floor of a scan: as in the same room of boxes, holes and shreds or not."""

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from scenes.mesh import BoxPart
from scenes.pose import Pose
from sim.navigation.floor import BODY_RADIUS_M, FloorMap
from sim.navigation.paths import has_way, walking_path
from sim.people.drawn_line import drawn_part, length_m
from sim.physics.scanned.objects import with_feet

ROOM = block((-2, -2, 0), (2, 2, 2.5), is_room=True)
TABLE = block((1.1, 0.2, 0.68), (1.7, 1.2, 0.72))


def box_part(low, high):
    middle, (x, y, z) = np.add(low, high) / 2, np.subtract(high, low) / 2
    return BoxPart(Pose.from_yaw(0.0, middle), (x, y, z))


def test_a_scan_leaves_the_floor_free_that_its_boxes_do(small_room, scanned_small_room):
    boxes, scan = FloorMap(small_room), FloorMap(scanned_small_room)
    unlike = boxes.bare.free != scan.bare.free
    # They differ by a cell along the edges at most.
    assert unlike.mean() < 0.08
    gap = np.linalg.norm(boxes.bare.centres()[unlike.ravel()], axis=1)
    assert gap.min(initial=9.0) > BODY_RADIUS_M
    assert scan.is_solid(np.array([1.12, 0.7]))
    assert not scan.is_solid(np.array([0.0, 0.0]))


def test_a_hole_in_the_floor_and_a_shred_in_the_air_bar_no_way(small_room, scanned_as):
    exact = scan_like(np.concatenate([ROOM, TABLE]), edge_m=0.1, noise_m=0.0, seed=0)
    middle = exact.mean(axis=1)
    is_hole = (np.abs(middle[:, :2]) < 0.5).all(axis=1) & (middle[:, 2] < 0.05)
    shred = np.array([[[0.0, 0.0, 1.0], [0.02, 0.0, 1.0], [0.0, 0.02, 1.02]]])
    room = scanned_as(small_room, np.concatenate([exact[~is_hole], shred]))
    floor = FloorMap(room).bare
    assert floor.is_clear(np.array([-1.5, 0.0]), np.array([0.7, 0.0]))
    assert not floor.is_clear(np.array([0.8, 0.7]), np.array([1.4, 0.7]))


def test_what_hangs_above_a_head_bars_no_way_and_what_hangs_below_does(small_room, scanned_as):
    for height, is_free in ((1.9, True), (1.5, False)):
        lamp = block((-0.3, -0.3, height), (0.3, 0.3, height + 0.1))
        room = scanned_as(small_room, np.concatenate([ROOM, lamp]))
        floor = FloorMap(room).bare
        assert floor.is_clear(np.array([-1.0, 0.0]), np.array([1.0, 0.0])) == is_free
        path = walking_path(floor, np.array([-1.0, 0.0]), np.array([1.0, 0.0]))
        assert (len(path) == 1) == is_free


def test_the_inside_of_a_cupboard_is_nowhere_to_stand(small_room, scanned_as):
    cupboard = block((0.6, 0.6, 0.0), (1.6, 1.6, 2.2))
    floor = FloorMap(scanned_as(small_room, np.concatenate([ROOM, cupboard]))).bare
    assert np.linalg.norm(floor.nearest_free(np.array([1.1, 1.1])) - (1.1, 1.1)) > 0.7


def test_a_wall_across_the_room_leaves_no_way(small_room, scanned_as):
    wall = block((-2, -0.05, 0), (2, 0.05, 2.5))
    floor = FloorMap(scanned_as(small_room, np.concatenate([ROOM, wall]))).bare
    assert not has_way(floor, np.array([0.0, -1.0]), np.array([0.0, 1.0]))
    assert has_way(floor, np.array([0.0, -1.0]), np.array([1.0, -1.5]))


def test_a_line_is_drawn_bit_by_bit():
    corners = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 1.0, 0]])
    assert length_m(corners) == pytest.approx(2.0)
    assert drawn_part(corners, 0.25) == pytest.approx(np.array([[0, 0, 0], [0.5, 0, 0]]))
    assert drawn_part(corners, 0.75) == pytest.approx(np.array([[0, 0, 0], [1, 0, 0], [1, 0.5, 0]]))
    assert drawn_part(corners, 1.0) == pytest.approx(corners)
    assert drawn_part(np.zeros((2, 3)), 0.5) == pytest.approx(np.zeros((2, 3)))


def test_feet_are_added_where_the_scan_has_missed_legs():
    top, leg = (
        box_part((-0.2, -0.2, 0.4), (0.2, 0.2, 0.44)),
        box_part((-0.2, -0.2, 0), (-0.16, -0.16, 0.4)),
    )
    whole = (
        top,
        *(
            box_part((x, y, 0), (x + 0.04, y + 0.04, 0.4))
            for x in (-0.2, 0.16)
            for y in (-0.2, 0.16)
        ),
    )
    assert with_feet(whole, (0.4, 0.4, 0.44)) == whole
    parts = with_feet((top, leg), (0.4, 0.4, 0.44))
    assert len(parts) == 5
    for foot in parts[2:]:
        low = foot.object_from_box.translation[2] - foot.half_size_m[2]
        assert low == pytest.approx(0.0)
        assert np.abs(foot.object_from_box.translation[:2]).min() > 0.13
    assert with_feet((box_part((-1, -1, 0), (1, 1, 1)),), (2, 2, 1))[1:] == ()
