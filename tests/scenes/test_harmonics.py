import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.frames import RDF_FROM_RUB
from scenes.harmonics import basis, slopes, turned, turning_matrix
from scenes.pose import Pose, rotation_from_quaternion


def directions(n, seed=0):
    d = np.random.default_rng(seed).normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_slopes_are_those_of_the_basis():
    d, step = directions(20), 1e-5
    for degree in range(4):
        found = slopes(d, degree)
        for axis, along in enumerate(step * np.eye(3)):
            wanted = (basis(d + along, degree) - basis(d - along, degree)) / (2 * step)
            np.testing.assert_allclose(found[..., axis], wanted, atol=1e-8)


def test_basis_is_orthonormal_on_the_sphere():
    # Gauss-Legendre in z times equal steps in azimuth integrates products of degree 6 exactly.
    z, weight = np.polynomial.legendre.leggauss(8)
    azimuth = np.arange(16) * 2 * np.pi / 16
    zz, aa = np.meshgrid(z, azimuth)
    r = np.sqrt(1 - zz**2)
    points = np.stack([r * np.cos(aa), r * np.sin(aa), zz], axis=-1).reshape(-1, 3)
    weights = np.tile(weight, 16) * 2 * np.pi / 16
    values = basis(points, 3)
    np.testing.assert_allclose(values.T @ (weights[:, None] * values), np.eye(16), atol=1e-12)


def test_order_and_signs_of_the_first_band_are_minus_y_z_minus_x():
    c = np.sqrt(3 / (4 * np.pi))
    np.testing.assert_allclose(basis(np.eye(3), 1)[:, 1:], [[0, 0, -c], [-c, 0, 0], [0, c, 0]])


quaternions = st.integers(0, 2**32 - 1).map(lambda s: np.random.default_rng(s).normal(size=4))


@given(quaternions)
def test_a_turned_cloud_looks_the_same_from_a_turned_direction(random_cloud, q):
    a_from_b = Pose(rotation_from_quaternion(q), np.array([1.0, 2.0, 3.0]))
    cloud = random_cloud(5, 3, 1)
    moved = turned(cloud, a_from_b)
    in_b = directions(40)
    seen_b = np.einsum("dk,nkc->ndc", basis(in_b, 3), cloud.sh)
    seen_a = np.einsum("dk,nkc->ndc", basis(in_b @ a_from_b.rotation.T, 3), moved.sh)
    np.testing.assert_allclose(seen_a, seen_b, atol=1e-5)
    np.testing.assert_allclose(moved.means, a_from_b @ cloud.means.astype(float), atol=1e-5)
    r = a_from_b.rotation
    np.testing.assert_allclose(
        moved.covariances(), r @ cloud.covariances() @ r.T, atol=1e-5, rtol=1e-4
    )


@given(quaternions, quaternions)
def test_turning_matrices_compose_like_rotations(p, q):
    a, b = rotation_from_quaternion(p), rotation_from_quaternion(q)
    product = turning_matrix(a, 3) @ turning_matrix(b, 3)
    np.testing.assert_allclose(turning_matrix(a @ b, 3), product, atol=1e-10)


def test_flips_of_two_axes_are_exact_signs():
    # Signs of y, z, x, xy, yz, zz, xz, xx-yy, ... under y -> -y, z -> -z.
    signs = [1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1]
    np.testing.assert_array_equal(turning_matrix(RDF_FROM_RUB.rotation, 3), np.diag(signs))
