import numpy as np
import pytest

from scenes.pose import rotation_from_vector
from scenes.prepare.align.alignment import apply_alignment
from scenes.prepare.align.by_length import align_by_length, align_by_object, picked_point
from scenes.prepare.align.similarity import Similarity
from tests.scenes.prepare.align.printed import capture

A, B = np.array([-2.5, 2.0, 0.7]), np.array([2.5, 2.2, 1.0])


@pytest.fixture(scope="module")
def room():
    reconstruction, _, truth = capture(np.random.default_rng(0), codes={}, feature_px=0.2)
    return reconstruction, truth


def test_two_points_and_a_length_give_the_scale(room):
    reconstruction, truth = room
    a, b = (truth.inverse() @ p for p in (A, B))
    length_m = float(np.linalg.norm(A - B))
    alignment = align_by_length(
        reconstruction, a, b, length_m=length_m, rng=np.random.default_rng(0)
    )
    assert alignment.metres_per_unit()[0] == pytest.approx(truth.scale, rel=1e-9)
    at_a, at_b = (alignment.world_from_reconstruction @ p for p in (a, b))
    np.testing.assert_allclose(at_a, [0, 0, 0.7], atol=0.01)
    np.testing.assert_allclose(at_b[1], 0, atol=0.01)
    assert at_b[0] > 4
    metric = apply_alignment(reconstruction, alignment)
    assert np.quantile(np.abs(metric.points[:, 2]), 0.08) < 0.01
    # The tape's error is what the scale's is, and grows away from where it was held.
    near, far = alignment.predicted_error_m(
        np.stack([(at_a + at_b) / 2, at_b + np.array([3, 0, 0])])
    )
    assert far > near
    assert far > 0.002


def test_a_clicked_point_is_triangulated(room):
    reconstruction, truth = room
    wanted = truth.inverse() @ np.array([0.2, 2.5, 1.5])
    picks = {}
    for view in reconstruction.views:
        pixels, valid = view.camera.project(view.world_from_camera.inverse() @ wanted[None])
        if valid[0]:
            picks[view.name] = pixels[0]
    np.testing.assert_allclose(picked_point(reconstruction, picks), wanted, atol=1e-6)
    with pytest.raises(ValueError, match="two photos or more"):
        picked_point(reconstruction, dict(list(picks.items())[:1]))
    with pytest.raises(ValueError, match=r"unknown: no\.jpg"):
        picked_point(reconstruction, {**picks, "no.jpg": [1.0, 2.0]})


@pytest.mark.parametrize(("b", "length_m"), [(A, 1.0), (B, 0.0), (B, np.nan)])
def test_lengths_that_are_none_are_refused(room, b, length_m):
    with pytest.raises(ValueError, match="length"):
        align_by_length(room[0], A, b, length_m=length_m, rng=np.random.default_rng(0))


def test_a_known_object_gives_the_scale(room):
    reconstruction, truth = room
    rng = np.random.default_rng(1)
    known_m = rng.uniform(0, 1, (3000, 3)) * [0.6, 0.5, 0.1]
    known_m[1500:] = rng.uniform(0, 1, (1500, 3)) * [0.1, 0.5, 0.9]
    seen = truth.inverse() @ (known_m[::4] + rng.normal(0, 0.002, (750, 3)) + [1.0, 0.5, 0.0])
    start = Similarity(
        1.08 / truth.scale,
        rotation_from_vector([0, 0.1, 0.05]) @ truth.rotation.T,
        truth.inverse() @ np.array([1.03, 0.48, 0.02]),
    )
    alignment = align_by_object(
        reconstruction,
        seen,
        known_m=known_m,
        reconstruction_from_known=start,
        rng=np.random.default_rng(0),
    )
    assert alignment.metres_per_unit()[0] == pytest.approx(truth.scale, rel=0.01)
    sphere = rng.normal(size=(500, 3))
    with pytest.raises(ValueError, match="5 % of its size"):
        align_by_object(
            reconstruction,
            truth.inverse() @ sphere,
            known_m=known_m,
            reconstruction_from_known=start,
            rng=np.random.default_rng(0),
        )
