import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.pose import (
    Pose,
    interpolate,
    quaternion_from_rotation,
    rotation_angle,
    rotation_from_quaternion,
    rotation_from_vector,
    wrap_angle,
)


def pose_of(seed: int) -> Pose:
    rng = np.random.default_rng(seed)
    return Pose(rotation_from_quaternion(rng.normal(size=4)), rng.uniform(-10, 10, 3))


seeds = st.integers(0, 2**32 - 1)
poses = seeds.map(pose_of)
angles = st.floats(-math.pi, math.pi)


def check_same(a: Pose, b: Pose, atol=1e-10):
    np.testing.assert_allclose(a.matrix(), b.matrix(), atol=atol)


@given(poses, poses, poses)
def test_composition_is_associative(a, b, c):
    check_same((a @ b) @ c, a @ (b @ c))


@given(poses)
def test_identity_and_inverse(a):
    check_same(a @ Pose.identity(), a)
    check_same(Pose.identity() @ a, a)
    check_same(a @ a.inverse(), Pose.identity())
    check_same(a.inverse() @ a, Pose.identity())
    check_same(a.inverse().inverse(), a, atol=1e-12)


@given(poses, poses, seeds)
def test_composing_is_mapping_in_turn(a, b, seed):
    points = np.random.default_rng(seed).normal(size=(2, 5, 3))
    np.testing.assert_allclose((a @ b) @ points, a @ (b @ points), atol=1e-10)
    np.testing.assert_allclose(a @ points[0, 0], (a @ points)[0, 0], atol=1e-12)
    homogeneous = np.append(points[0, 0], 1.0)
    np.testing.assert_allclose(a.matrix() @ homogeneous, np.append(a @ points[0, 0], 1.0))


@given(poses)
def test_inverse_reverses_the_order(a):
    b = pose_of(7)
    check_same((a @ b).inverse(), b.inverse() @ a.inverse())


@given(poses)
def test_quaternion_round_trip(a):
    q = a.quaternion()
    assert q[0] >= 0
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-12)
    check_same(Pose.from_quaternion(q, a.translation), a, atol=1e-12)
    check_same(Pose.from_quaternion(-q, a.translation), a, atol=1e-12)
    check_same(Pose.from_matrix(a.matrix()), a, atol=0)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("degrees", [0.0, 90.0, 179.9999, 180.0])
def test_quaternion_round_trip_near_half_turns(axis, degrees):
    vector = np.zeros(3)
    vector[axis] = math.radians(degrees)
    rotation = rotation_from_vector(vector)
    back = rotation_from_quaternion(quaternion_from_rotation(rotation))
    np.testing.assert_allclose(back, rotation, atol=1e-12)


@given(seeds)
def test_one_quaternion_gives_the_bits_that_it_gives_among_others(seed):
    several = np.random.default_rng(seed).normal(size=(3, 4))
    for one, among_others in zip(several, rotation_from_quaternion(several), strict=True):
        np.testing.assert_array_equal(rotation_from_quaternion(one), among_others)


def test_a_quaternion_of_no_length_turns_nothing():
    assert np.isnan(rotation_from_quaternion(np.zeros(4))).all()


def test_known_quaternion_turns_x_to_y():
    quarter_about_z = [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
    a_from_b = Pose.from_quaternion(quarter_about_z)
    np.testing.assert_allclose(a_from_b @ np.array([1.0, 0, 0]), [0, 1, 0], atol=1e-12)


@given(poses, poses)
def test_handedness_is_kept(a, b):
    assert np.linalg.det((a @ b).rotation) == pytest.approx(1.0, abs=1e-9)


def test_long_chains_do_not_drift():
    step, total = pose_of(3), Pose.identity()
    for _ in range(5000):
        total = step @ total
    error = np.abs(total.rotation @ total.rotation.T - np.eye(3)).max()
    assert error < 1e-12


@given(angles, angles)
def test_yaws_add(a, b):
    turned = (Pose.from_yaw(a) @ Pose.from_yaw(b)).yaw()
    assert abs(wrap_angle(turned - a - b)) < 1e-9


@given(angles, st.floats(-0.5, 0.5), st.floats(0, math.pi))
def test_yaw_ignores_small_tilt(yaw, tilt, direction):
    axis = np.array([math.cos(direction), math.sin(direction), 0.0])
    tilted = Pose(rotation_from_vector(tilt * axis) @ Pose.from_yaw(yaw).rotation, np.zeros(3))
    assert abs(wrap_angle(tilted.yaw() - yaw)) < 1e-9


@given(seeds, st.floats(0, math.pi - 1e-6))
def test_rotation_vector_and_angle(seed, angle):
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    rotation = rotation_from_vector(angle * axis)
    assert rotation_angle(rotation) == pytest.approx(angle, abs=1e-7)
    np.testing.assert_allclose(rotation @ axis, axis, atol=1e-12)


@given(poses, poses, st.floats(0, 1))
def test_interpolation_ends_and_constant_speed(a, b, fraction):
    check_same(interpolate(a, b, 0.0), a)
    check_same(interpolate(a, b, 1.0), b)
    between = interpolate(a, b, fraction)
    whole = rotation_angle(a.rotation.T @ b.rotation)
    assert rotation_angle(a.rotation.T @ between.rotation) == pytest.approx(
        fraction * whole, abs=1e-6
    )


@given(st.floats(-100, 100))
def test_wrapped_angles(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


def test_poses_are_values():
    rotation = np.eye(3)
    pose = Pose(rotation, np.zeros(3))
    rotation[0, 0] = 5.0
    assert pose.rotation[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        pose.translation[0] = 1.0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Pose(np.eye(4), np.zeros(3)), "rotation: shape"),
        (lambda: Pose(np.eye(3), np.zeros(2)), "translation: shape"),
        (lambda: Pose(np.eye(3), np.array([0, np.nan, 0])), "not finite"),
        (lambda: Pose(np.full((3, 3), np.inf), np.zeros(3)), "not finite"),
        (lambda: Pose.from_yaw(np.nan), "not finite"),
        (lambda: Pose.from_yaw(0.0, (0.0, np.inf, 0.0)), "not finite"),
        (lambda: Pose.from_yaw(0.0, (0.0, 0.0)), "shape"),
        (lambda: Pose(2 * np.eye(3), np.zeros(3)), "not a rotation"),
        (lambda: Pose(np.diag([1.0, 1.0, -1.0]), np.zeros(3)), "det = -1"),
        (lambda: Pose.from_quaternion([1, 1, 0, 0]), "norm 1.41"),
        (lambda: Pose.from_quaternion([0, 0, 0, 0]), "norm 0"),
        (lambda: Pose.from_quaternion([np.nan, 0, 0, 0]), "norm nan"),
        (lambda: Pose.from_quaternion([1, 0, 0]), "4 numbers"),
        (lambda: Pose.from_matrix(np.eye(3)), r"wanted \(4, 4\)"),
    ],
)
def test_what_is_no_pose_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()
