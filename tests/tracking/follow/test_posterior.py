"""Prior of a pose before a frame is measured, and acceptance of the measurement."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.follow.posterior import (
    ACCEPTED_CONTOUR_SCORE,
    CONCLUSIVE_INLIER_RATIO,
    CONTACT_SIGMA_M,
    HEAVY_HEIGHT_M,
    MIN_VISIBLE,
    MOVING_SIGMA_M,
    RECOGNISED_CONTOUR_SCORE,
    REST_RADIUS_M,
    RESTING_SIGMA_M,
    has_left_its_rest,
    is_accepted,
    is_conclusive,
    min_correlation,
    priors,
    shows_pattern,
)

TABLE_M = 0.74
SMALL, HEAVY = (0.2, 0.2, 0.1), (0.5, 0.5, 0.9)


def a_fit(
    contour_score=0.9,
    *,
    visible=1.0,
    covered=0.0,
    textured=False,
    colour_correlation=0.7,
    at=(0.0, 0.0, TABLE_M),
):
    return SimpleNamespace(
        world_from_object=Pose.from_yaw(0.0, at),
        contour_score=contour_score,
        unoccluded_inlier_ratio=contour_score,
        score=contour_score,
        visible_fraction=visible,
        covered_fraction=covered,
        textured=textured,
        colour_correlation=colour_correlation,
    )


def a_task(box_m=SMALL, *, state=TrackState.STATIC, missed=0, contains=True, **remembered):
    known = {
        "usual_correlation": 0.0, "usual_inlier_ratio": 0.0, "initial_correlation": 1.0,
        "still_frames": 6,
    }  # fmt: skip
    track = SimpleNamespace(
        world_from_object=Pose.from_yaw(0.0, (0.0, 0.0, TABLE_M)),
        state=state,
        missed_frames=missed,
        silhouette_bias_m=0.002,
        silhouette_bias_sigma_m=0.001,
        **{**known, **remembered},
    )
    return SimpleNamespace(
        track=track,
        model=SimpleNamespace(source=SimpleNamespace(box_m=box_m, support_z_m=0.0), textured=False),
        support_heights_m=(0.0, TABLE_M),
        scene=SimpleNamespace(contains=lambda _pose: contains),
    )


def believed(task, height_m):
    return priors(task, Pose.from_yaw(0.3, (1.0, 2.0, height_m)))


def test_what_is_heavy_stands_on_the_floor_until_it_is_seen_in_the_air():
    (only,) = believed(a_task(HEAVY), 0.05)
    assert only.mean[2] == 0.0
    assert only.sigma[2] == CONTACT_SIGMA_M
    np.testing.assert_allclose(only.mean[[0, 1, 3]], (1.0, 2.0, 0.3))
    assert HEAVY[2] >= HEAVY_HEIGHT_M > SMALL[2]
    (carried,) = believed(a_task(HEAVY), 0.3)
    assert carried.sigma[2] > CONTACT_SIGMA_M


@pytest.mark.parametrize(
    ("above_m", "heights"),
    [(0.01, [TABLE_M, None]), (0.1, [None, TABLE_M]), (0.4, [None])],
)
def test_a_small_thing_stands_near_a_support_and_is_carried_above_it(above_m, heights):
    found = believed(a_task(), TABLE_M + above_m)
    assert [p.mean[2] if p.sigma[2] == CONTACT_SIGMA_M else None for p in found] == heights
    assert all(prior.silhouette_bias_m == 0.002 for prior in found)


def test_what_rests_is_expected_nearer_than_what_moves_and_what_was_missed_farther():
    resting, moving, missed = (
        believed(task, TABLE_M)[0].sigma[0]
        for task in (
            a_task(),
            a_task(state=TrackState.TRACKED),
            a_task(state=TrackState.TRACKED, missed=4),
        )
    )
    assert resting == RESTING_SIGMA_M
    assert moving == MOVING_SIGMA_M
    assert missed == pytest.approx(3.0 * MOVING_SIGMA_M)


@pytest.mark.parametrize(
    ("state", "moved_m", "left"),
    [
        (TrackState.STATIC, REST_RADIUS_M + 1e-3, True),
        (TrackState.STATIC, REST_RADIUS_M - 1e-3, False),
        (TrackState.TRACKED, 1.0, False),
    ],
)
def test_only_what_rested_can_leave_its_rest(state, moved_m, left):
    fit = a_fit(at=(moved_m, 0.0, TABLE_M))
    assert has_left_its_rest(a_task(state=state), fit) == left


def test_a_good_outline_convinces_unless_the_object_usually_shows_a_better_one():
    assert is_conclusive(a_task(), a_fit(0.6))
    assert not is_conclusive(a_task(), a_fit(CONCLUSIVE_INLIER_RATIO - 0.01))
    assert not is_conclusive(a_task(usual_inlier_ratio=0.9), a_fit(0.6))
    assert not is_conclusive(a_task(), a_fit(0.9, textured=True, colour_correlation=0.2))
    assert is_conclusive(a_task(), a_fit(0.9, textured=False, colour_correlation=0.2))


def test_a_pattern_that_is_recognised_needs_less_of_an_outline():
    faint = RECOGNISED_CONTOUR_SCORE + 0.01
    assert faint < ACCEPTED_CONTOUR_SCORE
    assert shows_pattern(a_fit(textured=True))
    assert not shows_pattern(a_fit(textured=False))
    assert not shows_pattern(a_fit(textured=True, visible=0.5))
    assert is_accepted(a_fit(faint, textured=True))
    assert not is_accepted(a_fit(faint, textured=False))
    assert not is_accepted(a_fit(faint, textured=True, colour_correlation=0.4))
    assert not is_accepted(a_fit(visible=MIN_VISIBLE - 0.01))


def test_a_blurred_scan_lowers_what_is_asked_of_a_pattern():
    clear, blurred = (a_task(initial_correlation=value).track for value in (0.9, 0.2))
    assert min_correlation(blurred) == pytest.approx(0.17)
    assert min_correlation(clear) > 2 * min_correlation(blurred)
