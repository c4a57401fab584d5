import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.pose import Pose, rotation_from_quaternion
from scenes.splats import SH_C0, SplatCloud, concatenate, validate

ARRAYS = ("means", "scales", "rotations", "opacities", "sh")


def changed(cloud, **fields):
    return SplatCloud(*(fields.get(name, getattr(cloud, name)) for name in ARRAYS))


def test_clouds_are_values_of_float32(random_cloud):
    means = np.zeros((2, 3))
    cloud = changed(random_cloud(2), means=means)
    means[0, 0] = 7.0
    assert cloud.means[0, 0] == 0.0
    for name in ARRAYS:
        array = getattr(cloud, name)
        assert array.dtype == np.float32
        assert not array.flags.writeable


def test_a_float32_array_is_copied_before_it_is_locked(random_cloud):
    means = np.zeros((2, 3), np.float32)
    cloud = changed(random_cloud(2), means=means)
    means[0, 0] = 7.0
    assert cloud.means[0, 0] == 0.0


@pytest.mark.parametrize("degree", range(4))
def test_degree_and_length(random_cloud, degree):
    cloud = random_cloud(5, degree)
    assert len(cloud) == 5
    assert cloud.sh_degree == degree


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("means", (2, 2)),
        ("scales", (3, 3)),
        ("rotations", (2, 3)),
        ("opacities", (2, 1)),
        ("sh", (2, 3)),
        ("sh", (2, 2, 3)),
        ("sh", (2, 1, 4)),
    ],
)
def test_wrong_shapes_are_named(random_cloud, name, shape):
    with pytest.raises(ValueError, match=rf"SplatCloud\.{name}"):
        changed(random_cloud(2), **{name: np.zeros(shape, np.float32)})


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_covariances_turn_with_the_cloud(random_cloud, cloud_seed, pose_seed):
    cloud = random_cloud(4, 0, cloud_seed)
    rng = np.random.default_rng(pose_seed)
    a_from_b = Pose(rotation_from_quaternion(rng.normal(size=4)), rng.uniform(-3, 3, 3))
    moved = cloud.transformed(a_from_b)
    r = a_from_b.rotation
    np.testing.assert_allclose(moved.covariances(), r @ cloud.covariances() @ r.T, atol=1e-6)
    np.testing.assert_allclose(moved.means, a_from_b @ cloud.means.astype(float), atol=1e-5)
    np.testing.assert_array_equal(moved.scales, cloud.scales)


def test_covariance_of_a_turned_disc():
    half = math.sqrt(0.5)
    disc = SplatCloud(
        np.zeros((1, 3)),
        np.array([[3.0, 2.0, 1.0]]),
        np.array([[half, 0, 0, half]]),
        np.ones(1),
        np.zeros((1, 1, 3)),
    )
    np.testing.assert_allclose(disc.covariances()[0], np.diag([4.0, 9.0, 1.0]), atol=1e-5)


def test_view_dependent_colour_is_not_turned_silently(random_cloud):
    with pytest.raises(ValueError, match="K = 4"):
        random_cloud(1, 1).transformed(Pose.identity())


def test_colours_are_the_degree_0_term(random_cloud):
    cloud = random_cloud(3, 2)
    np.testing.assert_allclose(cloud.colours(), 0.5 + SH_C0 * cloud.sh[:, 0], rtol=1e-6)


def test_selecting_by_mask_and_by_index(random_cloud):
    cloud = random_cloud(4, 1)
    mask = np.array([True, False, True, False])
    for name in ARRAYS:
        picked = getattr(cloud, name)[[0, 2]]
        np.testing.assert_array_equal(getattr(cloud.select(mask), name), picked)
        reordered = getattr(cloud, name)[[2, 0]]
        np.testing.assert_array_equal(getattr(cloud.select(np.array([2, 0])), name), reordered)


def test_concatenation_pads_lower_degrees_with_zeros(random_cloud):
    plain, rich = random_cloud(2, 0, 1), random_cloud(3, 2, 2)
    whole = concatenate([plain, rich])
    assert (len(whole), whole.sh_degree) == (5, 2)
    np.testing.assert_array_equal(whole.sh[:2, 0], plain.sh[:, 0])
    assert not whole.sh[:2, 1:].any()
    np.testing.assert_array_equal(whole.sh[2:], rich.sh)
    np.testing.assert_array_equal(whole.means, np.concatenate([plain.means, rich.means]))
    with pytest.raises(ValueError, match="no clouds"):
        concatenate([])


def test_good_and_empty_clouds_are_valid(random_cloud):
    validate(random_cloud(50, 3), "good")
    validate(random_cloud(0), "empty")
    cloud = random_cloud(2)
    validate(changed(cloud, opacities=np.array([0.0, 1.0])), "ends")


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_named(random_cloud, name, value):
    cloud = random_cloud(5, 1)
    array = getattr(cloud, name).copy()
    array.reshape(5, -1)[3, -1] = value
    with pytest.raises(ValueError, match=rf"x\.ply: {name}: 1 of 5 .* number 3 .*finite"):
        validate(changed(cloud, **{name: array}), "x.ply")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("scales", 0.0, "scales.*> 0"),
        ("scales", -1.0, "scales.*> 0"),
        ("rotations", 0.0, "quaternion norm"),
        ("rotations", 2.0, "quaternion norm"),
        ("opacities", -0.001, "opacities.*0..1"),
        ("opacities", 1.001, "opacities.*0..1"),
    ],
)
def test_values_no_scan_has_are_named(random_cloud, name, value, said):
    cloud = random_cloud(3)
    array = getattr(cloud, name).copy()
    array[1] = value
    with pytest.raises(ValueError, match=said):
        validate(changed(cloud, **{name: array}), "x")
