"""The solve of one object in one window of a filmed table."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import (
    COLD_REACHES,
    LEVEL_SIGMA_RAD,
    ROUGH_POINTS,
    ROUND_YAW_SIGMA,
    SILHOUETTE_BIAS_M,
    SILHOUETTE_BIAS_SIGMA_M,
    SUPPORT_SIGMA_M,
    Fit,
    Prior,
    judge,
    roughly,
    solve,
)
from tracking.solve.motion import pose_vector

STANDING = np.array([0.1, 0.1, 0.003, 0.25])


def solved(table, scene, name, start, true, **options):
    """The solve of an object that stands somewhere, from a start."""
    evidence = table.evidence(scene, name, start)
    mean = pose_vector(start)
    mean[2] = true.translation[2]
    model = options.pop("model", table.models[name])
    return solve(evidence, model, start, Prior(mean, STANDING), table.renderer, **options)


def beside(pose, dx, dy, yaw_deg):
    turned = Pose.from_yaw(pose.yaw() + math.radians(yaw_deg), pose.translation)
    return Pose(turned.rotation, pose.translation + np.array([dx, dy, 0.0]))


def off(fit, true):
    """Metres and degrees."""
    found = fit.world_from_object
    metres = float(np.linalg.norm(found.translation - true.translation))
    return metres, abs(math.degrees(wrap_angle(found.yaw() - true.yaw())))


@pytest.mark.parametrize(
    ("name", "step", "most"),
    [("book-1", (0.015, -0.01, 6.0), (0.010, 2.0)), ("box-1", (-0.01, 0.01, -5.0), (0.010, 3.0))],
)
def test_a_start_beside_it_comes_to_where_it_is(table, as_scanned, name, step, most):
    true = table.poses[name]
    fit = solved(table, as_scanned, name, beside(true, *step), true, reaches_px=COLD_REACHES)
    metres, degrees = off(fit, true)
    assert metres < most[0]
    assert degrees < most[1]
    assert fit.edge_inlier_ratio > 0.6
    assert fit.visible_fraction > 0.7
    assert fit.covered_fraction < 0.1


def test_the_covariance_is_one_and_what_stands_is_known_in_height(table, as_scanned):
    true = table.poses["book-1"]
    fit = solved(table, as_scanned, "book-1", true, true)
    np.testing.assert_allclose(fit.covariance, fit.covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(fit.covariance).min() > 0.0
    sigma = np.sqrt(np.diag(fit.covariance))
    assert (sigma[:2] < 0.01).all()
    assert sigma[2] < 1.6 * SUPPORT_SIGMA_M
    assert sigma[3] < math.radians(3)
    assert abs(fit.response[2, 2]) < 0.9


def test_where_it_is_not_the_picture_does_not_agree(table, no_mug):
    true = table.poses["mug-1"]
    fit = solved(table, no_mug, "mug-1", true, true)
    assert fit.visible_fraction < 0.3
    assert fit.edge_inlier_ratio < 0.4


def test_the_colours_tell_the_yaw_of_a_pattern_from_that_of_its_back(table, as_scanned):
    true = table.poses["book-1"]
    turned = Pose.from_yaw(true.yaw() + math.pi, true.translation)
    right, wrong = (
        solved(table, as_scanned, "book-1", start, true, use_texture=False)
        for start in (true, turned)
    )
    assert right.textured
    assert right.colour_correlation > wrong.colour_correlation + 0.2
    assert right.score > wrong.score


def test_of_a_round_object_no_yaw_is_told(table, as_scanned):
    true, model = table.poses["mug-1"], table.models["mug-1"]
    ball = replace(model, symmetry=ROUND)
    fit = solved(table, as_scanned, "mug-1", true, true, model=ball)
    assert fit.covariance[3, 3] == pytest.approx(ROUND_YAW_SIGMA**2)
    np.testing.assert_array_equal(fit.covariance[3, :3], 0.0)
    assert off(fit, true)[1] < 0.1


def test_judging_changes_no_pose(table, as_scanned):
    true = table.poses["book-1"]
    fit = solved(table, as_scanned, "book-1", true, true)
    evidence = table.evidence(as_scanned, "book-1", true)
    moved = beside(fit.world_from_object, 0.03, 0.0, 0.0)
    prior = Prior(pose_vector(moved), STANDING)
    judged = judge(
        evidence, table.models["book-1"], moved, np.diag(prior.weights()), prior, fit.reduced
    )
    assert judged.world_from_object is moved
    assert judged.edge_inlier_ratio < fit.edge_inlier_ratio - 0.2


def test_a_solve_comes_by_the_same_bits(table, as_scanned):
    true = table.poses["box-1"]
    start = beside(true, 0.01, 0.0, 3.0)
    first, second = (solved(table, as_scanned, "box-1", start, true) for _ in range(2))
    np.testing.assert_array_equal(
        first.world_from_object.matrix(), second.world_from_object.matrix()
    )


def test_a_prior_weighs_what_it_knows():
    prior = Prior(np.zeros(4), np.array([0.1, 0.2, 0.003, 0.25]))
    wanted = [0.1, 0.2, 0.003, LEVEL_SIGMA_RAD, LEVEL_SIGMA_RAD, 0.25, SILHOUETTE_BIAS_SIGMA_M]
    np.testing.assert_allclose(prior.seven(), wanted)
    np.testing.assert_allclose(prior.weights(), 1.0 / np.array(wanted) ** 2)
    assert prior.silhouette_bias_m == SILHOUETTE_BIAS_M


def test_little_of_an_outline_is_little_support():
    fields = dict.fromkeys(Fit.__dataclass_fields__, 0.0)
    whole = Fit(
        **{**fields, "edge_inlier_ratio": 0.8, "unoccluded_ratio": 1.0, "colour_correlation": 0.5}
    )
    part = Fit(
        **{**fields, "edge_inlier_ratio": 0.2, "unoccluded_ratio": 0.25, "colour_correlation": 0.5}
    )
    assert whole.unoccluded_inlier_ratio == part.unoccluded_inlier_ratio == pytest.approx(0.8)
    assert (whole.contour_score, part.contour_score) == pytest.approx((0.8, 0.4))
    plain, patterned = (replace(whole, textured=textured) for textured in (False, True))
    assert plain.score == pytest.approx(0.8 * 0.75)
    assert patterned.score == pytest.approx(0.8 * 0.6)


def test_first_rounds_look_at_fewer_points():
    class Outline(SimpleNamespace):
        def __len__(self):
            return self.count

        def thinned(self, step):
            return step

    assert roughly(Outline(count=5 * ROUGH_POINTS)) == 5
    assert roughly(Outline(count=ROUGH_POINTS - 1)) == 1
