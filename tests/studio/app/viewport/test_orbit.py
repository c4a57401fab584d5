import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.app.viewport.orbit import MAX_DISTANCE_M, MAX_PITCH, MIN_DISTANCE_M, Orbit, home

ROOM = np.array([[-3.0, -2.5], [3.0, 2.5]])
DRAGS = st.lists(st.tuples(st.floats(-400, 400), st.floats(-400, 400)), max_size=8)


@given(DRAGS)
def test_turning_keeps_the_target_in_the_middle_at_the_same_distance(drags):
    orbit = home(ROOM)
    for dx, dy in drags:
        orbit = orbit.turned(dx, dy)
    target = orbit.world_from_camera().inverse() @ np.array(orbit.target)
    assert np.allclose(target, [0, 0, orbit.distance_m], atol=1e-9)
    assert abs(orbit.pitch) <= MAX_PITCH


@given(st.floats(-100, 100))
def test_zoom_stays_within_its_limits(steps):
    assert MIN_DISTANCE_M <= home(ROOM).zoomed(steps).distance_m <= MAX_DISTANCE_M


def test_panning_moves_what_is_seen_with_the_mouse():
    orbit, focal_px = home(ROOM), 500.0
    before = np.array(orbit.target)
    panned = orbit.panned(30.0, -20.0, focal_px=focal_px)
    seen = panned.world_from_camera().inverse() @ before
    assert seen[:2] / seen[2] * focal_px == pytest.approx([30.0, -20.0], abs=1e-6)


def test_flying_forward_goes_where_one_looks():
    orbit = Orbit((0.0, 0.0, 0.0), 0.0, 0.0, 2.0)
    flown = orbit.flown(0.0, 0.0, 0.5)
    assert flown.world_from_camera().translation == pytest.approx([1.5, 0.0, 0.0])
    assert flown.distance_m == orbit.distance_m


def test_home_looks_at_the_room_from_inside_its_height():
    eye = home(ROOM).world_from_camera().translation
    assert 1.0 < eye[2] < 2.6
