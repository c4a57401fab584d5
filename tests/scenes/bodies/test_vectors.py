"""Batches of vectors against numpy's own functions."""

import numpy as np

from scenes.bodies.vectors import (
    about,
    across,
    back,
    cross,
    frame,
    smooth,
    turned,
    wrapped,
    yaw_rotation,
)

RNG = np.random.default_rng(3)
A, B = RNG.normal(size=(2, 50, 2, 3))


def test_products_are_numpys():
    assert np.allclose(cross(A, B), np.cross(A, B))
    turn = yaw_rotation(RNG.uniform(-3, 3, (50, 2)))
    assert np.allclose(turned(turn, A), (turn @ A[..., None])[..., 0])
    assert np.allclose(back(turn, turned(turn, A)), A)


def test_a_frame_is_a_rotation_along_its_vector():
    along = A / np.linalg.norm(A, axis=-1, keepdims=True)
    made = frame(along, B)
    assert np.allclose(made @ np.swapaxes(made, -1, -2), np.eye(3))
    assert np.allclose(np.linalg.det(made), 1.0)
    assert np.allclose(made[..., 0], along)
    assert np.allclose(np.vecdot(across(B, along), along), 0.0)


def test_a_turn_about_up_is_a_yaw():
    up = np.array([0.0, 0.0, 1.0])
    angle = RNG.uniform(-3, 3, (50, 2))
    assert np.allclose(about(up, angle, vector=A), turned(yaw_rotation(angle), A))


def test_angles_wrap_and_steps_are_level_at_both_ends():
    assert np.allclose(wrapped(np.array([3.5 * np.pi, -3.0])), [-0.5 * np.pi, -3.0])
    assert smooth(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])).tolist() == [0.0, 0.0, 0.5, 1.0, 1.0]
