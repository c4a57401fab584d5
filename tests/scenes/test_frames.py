import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scenes.frames as frames
from scenes.pose import Pose

CONSTANTS = {name: value for name, value in vars(frames).items() if isinstance(value, Pose)}


def test_there_are_constants_and_their_names_say_from():
    assert len(CONSTANTS) >= 5
    assert all("_FROM_" in name for name in CONSTANTS)


@pytest.mark.parametrize("name", sorted(CONSTANTS))
def test_constants_keep_handedness_and_have_no_offset(name):
    a_from_b = CONSTANTS[name]
    assert np.linalg.det(a_from_b.rotation) == 1.0
    assert not a_from_b.translation.any()
    np.testing.assert_array_equal(np.abs(a_from_b.rotation).sum(axis=0), [1, 1, 1])


@pytest.mark.parametrize(
    ("a_from_b", "in_b", "in_a"),
    [
        # A camera's forward, in OpenGL, is -z; its down is -y.
        (frames.OPENGL_FROM_OPENCV, [0, 0, 1], [0, 0, -1]),
        (frames.OPENGL_FROM_OPENCV, [0, 1, 0], [0, -1, 0]),
        # glTF's up is our up, its forward (-z) is our +y.
        (frames.WORLD_FROM_GLTF, [0, 1, 0], [0, 0, 1]),
        (frames.WORLD_FROM_GLTF, [0, 0, -1], [0, 1, 0]),
        # SPZ's up is minus PLY's down, its back minus PLY's forward.
        (frames.RDF_FROM_RUB, [0, 1, 0], [0, -1, 0]),
        (frames.RDF_FROM_RUB, [0, 0, 1], [0, 0, -1]),
        # A level camera looks along +y, its image's down is our -z.
        (frames.WORLD_FROM_FORWARD_CAMERA, [0, 0, 1], [0, 1, 0]),
        (frames.WORLD_FROM_FORWARD_CAMERA, [0, 1, 0], [0, 0, -1]),
        (frames.WORLD_FROM_FORWARD_CAMERA, [1, 0, 0], [1, 0, 0]),
        # The back lens looks backwards, with the same down.
        (frames.FRONT_FROM_BACK_LENS, [0, 0, 1], [0, 0, -1]),
        (frames.FRONT_FROM_BACK_LENS, [0, 1, 0], [0, 1, 0]),
    ],
)
def test_known_directions(a_from_b, in_b, in_a):
    np.testing.assert_array_equal(a_from_b @ np.array(in_b, float), in_a)


points = st.tuples(*[st.floats(-10, 10)] * 3).map(np.array)


@given(points, points)
def test_look_at_puts_the_target_on_the_axis_and_is_level(eye, target):
    if np.linalg.norm(target - eye) < 1e-3:
        return
    world_from_camera = frames.look_at(eye, target)
    in_camera = world_from_camera.inverse() @ target
    distance = np.linalg.norm(target - eye)
    np.testing.assert_allclose(in_camera, [0, 0, distance], atol=1e-7 * (1 + distance))
    assert world_from_camera.rotation[2, 0] == pytest.approx(0.0, abs=1e-9)
    # Image down never points up.
    assert world_from_camera.rotation[2, 1] <= 1e-9


def test_look_at_straight_down_and_at_nothing():
    down = frames.look_at(np.array([0.0, 0, 3]), np.zeros(3))
    np.testing.assert_allclose(down.rotation[:, 2], [0, 0, -1])
    with pytest.raises(ValueError, match="coincide"):
        frames.look_at(np.ones(3), np.ones(3))
