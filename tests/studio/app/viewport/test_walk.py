import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.frames import look_at
from sim.navigation.floor import CELL_M, FreeFloor
from studio.app.viewport.orbit import home, orbit_of
from studio.app.viewport.viewer import MODES, Viewer, object_eyes
from studio.app.viewport.walk import EYES_M, Walker, walker_from

FREE = np.ones((40, 40), dtype=bool)
FREE[:, 20:] = False
FLOOR = FreeFloor(FREE, np.zeros(2))
WALL_X = 20 * CELL_M


def test_a_wall_stops_and_turns_aside():
    walker = Walker(WALL_X - 0.05, 1.0, math.radians(45.0))
    step = walker.walked(0.0, 0.2, FLOOR)
    assert step.x == walker.x
    assert step.y > walker.y
    straight = Walker(WALL_X - 0.05, 1.0, 0.0).walked(0.0, 0.2, FLOOR)
    assert (straight.x, straight.y) == (WALL_X - 0.05, 1.0)


@given(
    st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-90, 90)), max_size=30)
)
def test_nobody_walks_into_what_is_solid(steps):
    walker = Walker(0.8, 0.8, 0.0)
    for right, ahead, dx in steps:
        walker = walker.turned(dx, 0.0).walked(right, ahead, FLOOR)
        row, column = FLOOR.cell(np.array([walker.x, walker.y]))
        assert FLOOR.free[row, column]


def test_eyes_are_at_head_height_whatever_the_view_was():
    above = look_at(np.array([3.0, 1.0, 5.0]), np.array([0.5, 1.0, 0.0]))
    walker = walker_from(above, FLOOR)
    assert walker.world_from_camera().translation[2] == EYES_M
    assert walker.x < WALL_X


@pytest.fixture
def viewer():
    orbit = home(np.array([[0.0, 0.0], [4.0, 5.0]]))
    return Viewer(orbit, Walker(1.0, 1.0, 0.0))


def test_flying_begins_where_orbiting_was_and_back(viewer):
    before = viewer.world_from_camera()
    for mode in ("fly", "orbit"):
        viewer = viewer.in_mode(mode, None)
        now = viewer.world_from_camera()
        assert np.allclose(now.translation, before.translation, atol=1e-6)
        assert np.allclose(now.rotation, before.rotation, atol=1e-6)


def test_looking_around_while_flying_keeps_the_place(viewer):
    flying = viewer.in_mode("fly", None)
    place = flying.world_from_camera().translation
    looked = flying.dragged(40.0, -25.0).world_from_camera()
    assert np.allclose(looked.translation, place, atol=1e-6)
    assert not np.allclose(looked.rotation, flying.world_from_camera().rotation)


def test_turning_about_a_place_keeps_the_eye(viewer):
    place = viewer.world_from_camera().translation
    about = viewer.about(np.array([1.0, 1.0, 0.4]))
    assert np.allclose(about.world_from_camera().translation, place, atol=1e-6)
    assert about.orbit.target == (1.0, 1.0, 0.4)


def test_every_mode_steps_ahead(viewer):
    for mode in MODES:
        there = viewer.in_mode(mode, None)
        before = there.world_from_camera()
        after = there.stepped(0.0, 0.0, 1.0, floor=None).world_from_camera()
        moved = after.translation - before.translation
        assert moved @ before.rotation[:, 2] > 0.05


def test_an_orbit_is_the_camera_it_was_made_of(viewer):
    pose = viewer.world_from_camera()
    again = orbit_of(pose, 2.0).world_from_camera()
    assert np.allclose(again.matrix(), pose.matrix(), atol=1e-6)
    eyes = object_eyes(pose, 0.5)
    assert np.isclose(np.linalg.det(eyes.rotation), 1.0)
