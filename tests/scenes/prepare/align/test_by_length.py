import numpy as np
import pytest

from scenes.prepare.align.alignment import apply_alignment
from scenes.prepare.align.by_length import align_by_length, picked_point
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
