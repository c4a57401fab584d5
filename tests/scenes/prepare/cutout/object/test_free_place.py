"""A new object finds a place on the floor where nothing stands."""

import numpy as np
import pytest

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.prepare.cutout.object.free_place import BESIDE_M, free_place
from scenes.splats import SplatCloud, concatenate
from scenes.state import ObjectModel


def flat(points):
    n = len(points)
    return SplatCloud(
        points, np.full((n, 3), 0.02), np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9),
        np.zeros((n, 1, 3)),
    )  # fmt: skip


def grid(low, high, step, z):
    x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])


def room(*more, objects=()):
    floor = flat(grid((-2, -1.5), (2, 1.5), 0.1, 0.0))
    cloud = concatenate([floor, *more])
    return ScenePackage(
        "room", cloud, objects, (), Pose.identity(), np.array([[-2.0, -1.5], [2.0, 1.5]]), None
    )


def test_an_empty_room_has_its_middle_free():
    assert free_place(room(), (0.4, 0.4, 0.9)) == pytest.approx((0.0, 0.0), abs=0.06)


def test_what_stands_in_the_middle_is_stepped_around():
    table = flat(grid((-0.5, -0.4), (0.5, 0.4), 0.04, 0.72))
    x, y = free_place(room(table), (0.4, 0.3, 0.9))
    away = np.hypot(max(abs(x) - 0.5, 0.0), max(abs(y) - 0.4, 0.0))
    assert away > 0.25 + BESIDE_M - 0.06
    # A low thing fits under the table's top.
    assert free_place(room(table), (0.4, 0.3, 0.3)) == pytest.approx((0.0, 0.0), abs=0.06)


def test_objects_are_in_the_way_too():
    item = ObjectModel(
        "c", "c", "", flat(np.zeros((1, 3))), (0.6, 0.6, 0.5), 0.0, Pose.from_yaw(0.3, (0, 0, 0))
    )
    x, y = free_place(room(objects=(item,)), (0.2, 0.2, 0.2))
    assert np.hypot(x, y) > 0.3 + 0.14 + BESIDE_M - 0.06


def test_where_no_floor_was_seen_nothing_is_put():
    package = room()
    without = package.room.select(np.linalg.norm(package.room.means[:, :2], axis=1) > 0.6)
    seen = ScenePackage("r", without, (), (), Pose.identity(), package.footprint_m, None)
    x, y = free_place(seen, (0.3, 0.3, 0.3))
    assert np.hypot(x, y) > 0.6


def test_a_full_room_says_what_to_do():
    with pytest.raises(ValueError, match=r"--at X,Y"):
        free_place(room(), (4.0, 4.0, 1.0))
