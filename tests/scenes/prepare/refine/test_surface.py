"""Splats put on one surface: each term does what it says."""

import numpy as np
import pytest

from scenes.pose import rotation_from_quaternion
from scenes.prepare.refine.surface import MAX_STRETCH, SurfaceTerms, put_on_surface
from scenes.prepare.train.optimiser.rows import LOG_SCALE, LOGIT, MEAN, ROTATION, SH

NOTHING = {"flat": np.inf, "along": 0.0, "onto": 0.0, "opaque": 0.0, "albedo": 0.0}


@pytest.fixture
def rows():
    """Splats around the plane z = 0, in two layers 2 cm apart, turned anyhow."""
    rng = np.random.default_rng(3)
    values = np.zeros((400, 23), np.float32)
    values[:, MEAN] = rng.uniform(-0.5, 0.5, (400, 3))
    values[:, 2] = np.where(np.arange(400) % 2, 0.01, -0.01)
    values[:, LOG_SCALE] = np.log(rng.uniform(0.01, 0.03, (400, 3)))
    values[:, ROTATION] = rng.normal(size=(400, 4))
    values[:, SH] = rng.normal(size=(400, 12))
    return values


def changed(rows, **terms):
    after = rows.copy()
    put_on_surface(after, SurfaceTerms(**{**NOTHING, **terms}))
    return after


def normals(rows):
    thin = rows[:, LOG_SCALE].argmin(axis=1)
    turned = rotation_from_quaternion(rows[:, ROTATION].astype(float))
    return turned[np.arange(len(rows)), :, thin]


def test_without_terms_nothing_moves(rows):
    np.testing.assert_array_equal(changed(rows), rows)


def test_flat_splats_are_thin_and_no_needles(rows):
    rows[0, LOG_SCALE] = np.log([0.5, 0.01, 0.01])
    scales = np.sort(np.exp(changed(rows, flat=0.1)[:, LOG_SCALE]), axis=1)
    assert (scales[:, 0] <= 0.1001 * scales[:, 1]).all()
    assert (scales[:, 2] <= 1.001 * MAX_STRETCH * scales[:, 1]).all()


def test_two_layers_become_one(rows):
    after = rows
    for _ in range(5):
        after = changed(after, onto=0.5)
    inner = (np.abs(rows[:, :2]) < 0.4).all(axis=1)
    assert np.abs(after[inner, 2]).mean() < 0.5 * 0.01
    np.testing.assert_allclose(after[inner, :2], rows[inner, :2], atol=5e-3)


def test_a_bent_surface_does_not_shrink():
    rng = np.random.default_rng(4)
    values = np.zeros((600, 14), np.float32)
    means = rng.normal(size=(600, 3))
    values[:, MEAN] = means / np.linalg.norm(means, axis=1, keepdims=True)
    values[:, ROTATION] = rng.normal(size=(600, 4))
    for _ in range(20):
        values = changed(values, onto=0.3)
    radius = np.linalg.norm(values[:, MEAN], axis=1)
    assert np.median(radius) == pytest.approx(1.0, abs=0.01)


def test_normals_turn_to_the_plane_they_lie_in(rows):
    after = rows
    for _ in range(12):
        after = changed(after, along=0.3)
    inner = (np.abs(rows[:, :2]) < 0.4).all(axis=1)
    before, now = (np.abs(normals(r)[inner, 2]) for r in (rows, after))
    assert before.mean() < 0.7
    assert np.median(now) > 0.97
    lengths = np.linalg.norm(rows[:, ROTATION], axis=1)
    np.testing.assert_allclose(np.linalg.norm(after[:, ROTATION], axis=1), lengths, rtol=1e-4)


def test_opaque_and_albedo(rows):
    after = changed(rows, opaque=0.5, albedo=0.25)
    np.testing.assert_allclose(after[:, LOGIT], rows[:, LOGIT] + 0.5)
    np.testing.assert_array_equal(after[:, SH][:, :3], rows[:, SH][:, :3])
    np.testing.assert_allclose(after[:, SH][:, 3:], 0.75 * rows[:, SH][:, 3:], rtol=1e-6)


def test_few_splats_have_no_plane(rows):
    few = rows[:5]
    np.testing.assert_array_equal(changed(few, along=1.0, onto=1.0), few)


@pytest.mark.parametrize(
    "terms", [{"along": 1.5}, {"onto": -0.1}, {"flat": 0.0}, {"albedo": np.nan}]
)
def test_terms_out_of_range_are_refused(terms):
    with pytest.raises(ValueError, match=f"SurfaceTerms.{next(iter(terms))}"):
        SurfaceTerms(**terms)
