import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from studio.app.viewport.by_hand.gizmo import Gizmo
from studio.app.viewport.by_hand.picking import length_m, nearest_on_line, pick, point_at, ray_of
from studio.app.viewport.by_hand.tools import InHand, Tool
from studio.app.viewport.view_overlay import measure_text

CAMERA = Pinhole.from_fov(320, 240, 1.1)
EYE = look_at(np.array([2.0, -3.0, 1.8]), np.array([0.0, 0.0, 0.3]))
places = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(0.0, 0.6)).map(np.array)


def pixel_of(point):
    return CAMERA.project(EYE.inverse() @ np.atleast_2d(point))[0][0]


def depth_of(point):
    return np.full((120, 160), (EYE.inverse() @ point)[2], np.float32)


@given(places)
def test_a_pixel_shows_the_place_that_projects_there(place):
    found = point_at(depth_of(place), CAMERA, EYE, *pixel_of(place))
    assert np.allclose(found, place, atol=1e-5)


def test_the_smallest_box_that_holds_the_place_is_picked():
    boxes = {
        "table": (Pose.identity(), (2.0, 2.0, 0.9)),
        "cup": (Pose.from_yaw(0.3, (0.1, 0.1, 0.7)), (0.1, 0.1, 0.1)),
    }

    def picked(place):
        return pick(boxes, depth_of(place), CAMERA, EYE, *pixel_of(place)).item_id

    assert picked(np.array([0.1, 0.1, 0.75])) == "cup"
    assert picked(np.array([0.5, 0.1, 0.5])) == "table"
    assert picked(np.array([0.5, 0.1, 0.0])) == ""
    assert pick(boxes, np.zeros((2, 2), np.float32), CAMERA, EYE, 1.0, 1.0) is None


@given(places, st.sampled_from(["x", "y", "z"]), st.floats(-0.5, 0.5))
@settings(deadline=None)
def test_dragging_an_arrow_moves_along_it_by_as_much(place, handle, by_m):
    pose = Pose.from_yaw(0.4, place)
    axis = np.eye(3)["xyz".index(handle)]
    gizmo = Gizmo(pose, CAMERA, EYE)
    start = tuple(pixel_of(place + 0.1 * axis))
    moved = gizmo.dragged(handle, start, tuple(pixel_of(place + (0.1 + by_m) * axis)))
    assert np.allclose(moved.translation, place + by_m * axis, atol=1e-4)
    assert np.allclose(moved.rotation, pose.rotation)


@given(places, st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
@settings(deadline=None)
def test_dragging_the_square_keeps_the_height(place, dx, dy):
    gizmo = Gizmo(Pose.from_yaw(0.0, place), CAMERA, EYE)
    to = place + np.array([dx, dy, 0.0])
    moved = gizmo.dragged("floor", tuple(pixel_of(place)), tuple(pixel_of(to)))
    assert np.allclose(moved.translation, to, atol=1e-4)


@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5))
@settings(deadline=None)
def test_dragging_the_ring_turns_by_the_angle(start, by):
    pose = Pose.from_yaw(0.2, (0.1, 0.1, 0.0))
    gizmo = Gizmo(pose, CAMERA, EYE, moves=False)

    def on_ring(angle):
        offset = 0.3 * np.array([math.cos(angle), math.sin(angle), 0.0])
        return tuple(pixel_of(pose.translation + offset))

    turned = gizmo.dragged("yaw", on_ring(start), on_ring(start + by))
    assert np.allclose(turned.rotation, Pose.from_yaw(0.2 + by).rotation, atol=1e-6)
    assert np.allclose(turned.translation, pose.translation)


@given(st.sampled_from(["tilt_x", "tilt_y"]), st.floats(-3.0, 3.0), st.floats(-1.5, 1.5))
@settings(deadline=None)
def test_dragging_a_ring_about_a_level_axis_tilts(handle, start, by):
    pose, heading = Pose.from_yaw(0.7, (0.1, 0.1, 0.3)), 0.7
    gizmo = Gizmo(pose, CAMERA, EYE, moves=False, tilts=True, heading_rad=heading)
    axis = pose.rotation[:, "xy".index(handle[-1])]
    across = np.cross(axis, (0.0, 0.0, 1.0))

    def on_ring(angle):
        way = math.cos(angle) * across + math.sin(angle) * np.cross(axis, across)
        return tuple(pixel_of(pose.translation + 0.2 * way))

    tilted = gizmo.dragged(handle, on_ring(start), on_ring(start + by))
    assert tilted.rotation @ pose.rotation.T @ axis == pytest.approx(axis), "about that axis"
    turned = tilted.rotation @ pose.rotation.T @ across
    assert turned == pytest.approx(math.cos(by) * across + math.sin(by) * np.cross(axis, across))


@given(st.sampled_from(["size_x", "size_y", "size_z"]), st.floats(0.4, 2.0))
@settings(deadline=None)
def test_dragging_an_end_sizes_that_side_alone(handle, factor):
    pose = Pose.from_yaw(0.4, (0.0, 0.1, 0.2))
    gizmo = Gizmo(pose, CAMERA, EYE, moves=False, turns=False, sides=True)
    axis = pose.rotation[:, "xyz".index(handle[-1])]
    ends = [tuple(pixel_of(pose.translation + length * axis)) for length in (0.2, 0.2 * factor)]
    factors = dict(zip(("size_x", "size_y", "size_z"), gizmo.sized(handle, *ends), strict=True))
    assert factors.pop(handle) == pytest.approx(factor, rel=1e-3)
    assert list(factors.values()) == [1.0, 1.0]


def test_the_square_sizes_all_sides_by_how_far_it_is_dragged():
    pose = Pose.from_yaw(0.4, (0.0, 0.1, 0.2))
    gizmo = Gizmo(pose, CAMERA, EYE, sizes=True)
    middle = pixel_of(pose.translation)
    start, end = gizmo.lines()["size"]
    assert gizmo.hit(*end) == "size"
    twice = tuple(middle + 2 * (end - middle))
    assert gizmo.sized("size", tuple(end), twice) == pytest.approx((2.0, 2.0, 2.0))
    assert min(gizmo.sized("size", tuple(start), tuple(middle))) > 0


def test_a_press_takes_the_handle_under_it_and_no_other():
    gizmo = Gizmo(Pose.from_yaw(0.0, (0.0, 0.0, 0.3)), CAMERA, EYE, turns=False)
    for handle, line in gizmo.lines().items():
        x, y = line.mean(axis=0) if handle != "floor" else line[2]
        assert gizmo.hit(x, y) == handle
    assert gizmo.hit(5.0, 5.0) is None
    behind = Gizmo(Pose.from_yaw(0.0, (4.0, -6.0, 1.0)), CAMERA, EYE)
    assert behind.lines() == {}


def test_a_ray_along_a_line_says_nothing():
    eye, ray = ray_of(CAMERA, EYE, 160.0, 120.0)
    assert nearest_on_line(eye, ray, point=np.zeros(3), axis=ray) is None


def test_measures_are_in_metres_with_their_parts():
    places_ = [np.zeros(3), np.array([3.0, 4.0, 0.0]), np.array([3.0, 4.0, 1.0])]
    assert length_m(places_) == pytest.approx(6.0)
    assert measure_text(places_[:2]) == "5.000 m   floor 5.000 m   up +0.000 m"
    hand = InHand(Tool.SURFACE)
    for place in [*places_, np.ones(3)]:
        assert not hand.is_complete
        hand = hand.picked(place)
    assert hand.is_complete
