import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.pose import Pose, rotation_from_vector
from scenes.quad import quad_of

POSTER = np.array([[-0.6, -0.5, 1.5], [0.6, -0.5, 1.5], [0.6, 0.3, 1.5], [-0.6, 0.3, 1.5]])

small = st.floats(-0.25, 0.25)
anything = st.floats(-3, 3)
unit = st.floats(0, 1)


@given(
    corners=st.lists(st.tuples(small, small), min_size=4, max_size=4),
    turn=st.tuples(anything, anything, anything),
    shift=st.tuples(anything, anything, anything),
    ends=st.lists(st.tuples(unit, unit), min_size=2, max_size=2),
    share=unit,
)
def test_pictures_lie_on_quads_by_a_homography(corners, turn, shift, ends, share):
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) + np.array(corners)
    world_from_plane = Pose(rotation_from_vector(np.array(turn)), np.array(shift))
    in_world = world_from_plane @ np.concatenate([square, np.zeros((4, 1))], axis=1)
    quad = quad_of(in_world)
    at_corners, exist = quad.points([[0, 0], [1, 0], [1, 1], [0, 1]])
    assert exist.all()
    np.testing.assert_allclose(at_corners, in_world, atol=1e-5)
    np.testing.assert_allclose(
        quad.places((quad.world_from_plane.inverse() @ at_corners)[:, :2]),
        [[0, 0], [1, 0], [1, 1], [0, 1]],
        atol=1e-5,
    )
    # Straight lines stay straight and on the plane.
    a, b = np.array(ends)
    points, exist = quad.points([a, a + share * (b - a), b])
    assert exist.all()
    np.testing.assert_allclose((world_from_plane.inverse() @ points)[:, 2], 0, atol=1e-6)
    area = np.linalg.norm(np.cross(points[1] - points[0], points[2] - points[0]))
    assert area < 1e-5
    assert quad.faces(world_from_plane @ np.array([0.0, 0.0, -1.0]))
    assert not quad.faces(world_from_plane @ np.array([0.0, 0.0, 1.0]))


def test_beyond_the_horizon_there_is_nothing():
    narrowing = np.array([[-1.0, 0, 4], [1, 0, 4], [0.2, 1, 4], [-0.2, 1, 4]])
    _, exists = quad_of(narrowing).points([[0.5, 0.5], [0.5, 1.05], [0.5, 40.0]])
    assert exists.tolist() == [True, True, True]
    _, exists = quad_of(narrowing).points([[0.5, -40.0]])
    assert not exists.any()
    assert np.isnan(quad_of(narrowing).places([[1.0, 40.0]])).all()


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (POSTER[:3], "four finite"),
        (np.where(POSTER == 0.3, np.nan, POSTER), "four finite"),
        (POSTER[[0, 2, 1, 3]], "convex|span no area"),
        (POSTER + np.array([[0, 0, 0.5], [0, 0, 0], [0, 0, 0.5], [0, 0, 0]]), "off their plane"),
        (POSTER[[0, 0, 0, 0]], "span no area"),
        (np.array([[0, 0, 1], [1, 0, 1], [0.2, 0.2, 1], [0, 1, 1.0]]), "convex"),
    ],
)
def test_what_is_no_flat_quad_is_refused(corners, message):
    with pytest.raises(ValueError, match=message):
        quad_of(corners)
