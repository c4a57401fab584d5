from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.harmonics import basis
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.align.similarity import Similarity, similarity_from_points
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.splats import SplatCloud

numbers = st.floats(-5.0, 5.0)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
similarities = st.builds(
    lambda log_scale, turn, move: Similarity(np.exp(log_scale), rotation_from_vector(turn), move),
    st.floats(-2.0, 2.0),
    vectors,
    vectors,
)


@given(similarities, similarities, vectors)
@settings(deadline=None)
def test_composition_maps_as_one_after_the_other(a_from_b, b_from_c, x_in_c):
    np.testing.assert_allclose(
        (a_from_b @ b_from_c) @ x_in_c, a_from_b @ (b_from_c @ x_in_c), atol=1e-9
    )


@given(similarities, vectors)
@settings(deadline=None)
def test_the_inverse_takes_back(a_from_b, x_in_b):
    np.testing.assert_allclose(a_from_b.inverse() @ (a_from_b @ x_in_b), x_in_b, atol=1e-9)
    homogeneous = a_from_b.matrix() @ np.append(x_in_b, 1.0)
    np.testing.assert_allclose(homogeneous[:3], a_from_b @ x_in_b, atol=1e-9)


@given(similarities, st.integers(0, 1000))
@settings(deadline=None)
def test_points_give_back_the_similarity_that_moved_them(a_from_b, seed):
    in_b = np.random.default_rng(seed).normal(size=(6, 3))
    found = similarity_from_points(a_from_b @ in_b, in_b)
    np.testing.assert_allclose(found.matrix(), a_from_b.matrix(), atol=1e-8)


def test_a_flat_square_gives_a_rotation_never_a_reflection():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    found = similarity_from_points(2 * square, square)
    np.testing.assert_allclose(
        found.matrix(), Similarity(2.0, np.eye(3), np.zeros(3)).matrix(), atol=1e-12
    )


def test_points_without_weight_do_not_count():
    in_b = np.random.default_rng(1).normal(size=(5, 3))
    in_a = 3 * in_b
    in_a[4] += 10
    found = similarity_from_points(in_a, in_b, weights=[1, 1, 1, 1, 0])
    assert found.scale == pytest.approx(3.0)


def test_points_on_a_line_are_refused():
    line = np.linspace(0, 1, 5)[:, None] * np.ones(3)
    with pytest.raises(ValueError, match="one line"):
        similarity_from_points(line, line)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_a_scale_that_is_no_scale_is_refused(scale):
    with pytest.raises(ValueError, match="scale"):
        Similarity(scale, np.eye(3), np.zeros(3))


def test_splats_keep_their_look():
    rng = np.random.default_rng(3)
    n = 20
    quaternions = rng.normal(size=(n, 4))
    cloud = SplatCloud(
        rng.normal(size=(n, 3)).astype(np.float32),
        rng.uniform(0.01, 0.2, (n, 3)).astype(np.float32),
        (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).astype(np.float32),
        rng.uniform(size=n).astype(np.float32),
        rng.normal(size=(n, 16, 3)).astype(np.float32),
    )
    a_from_b = Similarity(0.4, rotation_from_vector([0.3, -1.2, 0.5]), np.array([1.0, 2, 3]))
    moved = a_from_b.moved_cloud(cloud)
    np.testing.assert_allclose(moved.means, a_from_b @ cloud.means.astype(float), atol=1e-5)
    r = 0.4 * a_from_b.rotation
    np.testing.assert_allclose(moved.covariances(), r @ cloud.covariances() @ r.T, atol=1e-6)
    eye_in_b = np.array([4.0, -1, 2])
    for scan, eye in ((cloud, eye_in_b), (moved, a_from_b @ eye_in_b)):
        ray = scan.means.astype(float) - eye
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        seen = np.einsum("nk,nkc->nc", basis(ray, 3), scan.sh.astype(float))
        if scan is cloud:
            wanted = seen
    np.testing.assert_allclose(seen, wanted, atol=1e-4)


def test_a_moved_reconstruction_reprojects_to_the_same_pixels():
    rng = np.random.default_rng(5)
    camera = Pinhole.from_fov(640, 480, 1.0)
    points = rng.uniform(-1, 1, (30, 3)) + np.array([0, 0, 4])
    view = View(
        "a.jpg", Path("a.jpg"), camera, Pose(rotation_from_vector([0.1, 0.2, 0]), np.zeros(3))
    )
    flat = Reconstruction((view,), points, np.zeros((30, 3), np.uint8), np.zeros(30, np.float32))
    moved = Similarity(2.5, rotation_from_vector([1.0, 0, 0.4]), np.ones(3)).moved_reconstruction(
        flat
    )
    before = camera.project(view.world_from_camera.inverse() @ flat.points)[0]
    after = camera.project(moved.views[0].world_from_camera.inverse() @ moved.points)[0]
    np.testing.assert_allclose(after, before, atol=1e-8)
