"""When other yaws are compared, and how often."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.evidence.observation import observe
from tracking.follow import yaw_review
from tracking.follow.belief import Belief
from tracking.follow.track import Review, Track
from tracking.follow.yaw_review import (
    PERIOD_NS,
    REVIEW_PART,
    TURNED_NATS,
    is_under_review,
    review_yaw,
    was_reviewed,
)
from tracking.hypotheses.budget import Step
from tracking.hypotheses.hypothesis import Hypothesis
from tracking.likelihood.pixel_model import PoseSupport
from tracking.likelihood.pose_likelihood import pose_support
from tracking.solve.gauss_newton import Prior, solve
from tracking.solve.motion import pose_vector

SHARP = Pose.from_yaw(0.0)
FLIPPED = Pose.from_yaw(3.1)
RIG = Pose.identity()
PROPOSED_NS = round(REVIEW_PART * Step.YAWS.nominal_ms * 1e6)
LONG_NS = 100 * PROPOSED_NS


def a_fit(pose):
    return SimpleNamespace(
        world_from_object=pose,
        visible_fraction=0.95,
        covered_fraction=0.0,
        textured=False,
        colour_correlation=0.5,
        reduced=SimpleNamespace(contour=range(240), appearance=None),
    )


def support(nats):
    return PoseSupport(nats, 20.0, 1.0, 0.5, 0.0, 900.0)


def a_belief(pose, nats):
    return Belief("seen", a_fit(pose), support(nats), lambda: support(nats))


def a_track(review, state=TrackState.TRACKED):
    fields = {name: None for name in Track.__dataclass_fields__}
    return Track(**{**fields, "review": review, "state": state})


@pytest.fixture
def task(monkeypatch):
    """A task whose object stands turned by half from what it is taken for."""

    def refined(_scene, _model, start, _evidence, _observation, *, quickly=False, budget=None):
        assert not quickly
        if budget is not None:
            budget.do(Step.SOLVE, lambda: None)
        return Hypothesis(a_fit(start), support(30.0 if abs(start.yaw()) > 3.0 else 10.0))

    monkeypatch.setattr(yaw_review, "among_near_poses", lambda _task, belief: belief)
    monkeypatch.setattr(yaw_review, "likeliest_yaws", lambda *_: [SHARP, FLIPPED])
    monkeypatch.setattr(yaw_review, "refine", refined)
    model = SimpleNamespace(
        symmetry=1, radius_m=0.5, are_same=lambda turns: np.zeros(len(turns), bool)
    )

    def make(review, *, now_ns=0, interval_ns=LONG_NS, state=TrackState.TRACKED, rig=RIG):
        frame = SimpleNamespace(t_ns=now_ns)
        scene = SimpleNamespace(frame=frame, contains=lambda _pose: True, world_from_rig=rig)
        track = a_track(review, state)
        return yaw_review.Task(
            scene, model, track, (), (0.0,), False, False, True, True, True, interval_ns
        )

    return make


def test_a_yaw_is_given_up_for_a_clearly_likelier_one(task):
    after, fit = review_yaw(task(None), None, a_belief(SHARP, 10.0))
    assert fit.world_from_object is FLIPPED
    gained = pytest.approx(20.0 - TURNED_NATS)
    assert after.track.review.rival_nats == gained
    assert after.track.review.known_nats == gained
    assert after.track.review.is_clear
    assert was_reviewed(after.track, 0)


def test_a_yaw_that_was_known_needs_more_to_be_given_up(task):
    known = task(Review(-LONG_NS, 0, 50.0, 50.0))
    weak = a_belief(SHARP, 30.0 - TURNED_NATS)
    assert review_yaw(known, None, weak)[1] is weak.fit
    doubted = task(Review(-LONG_NS, 0, 0.0, 0.0))
    assert review_yaw(doubted, None, weak)[1].world_from_object is FLIPPED


def test_a_review_is_spread_over_frames_and_its_object_moves_on_meanwhile(task):
    first = task(None, interval_ns=PROPOSED_NS)
    begun, fit = review_yaw(first, "then", a_belief(SHARP, 10.0))
    assert is_under_review(begun.track)
    assert was_reviewed(begun.track, 0)
    assert begun.track.rival_nats == 0.0
    assert fit.world_from_object is SHARP
    second = task(begun.track.review, now_ns=PROPOSED_NS, interval_ns=LONG_NS)
    moved = Pose.from_yaw(0.1, [0.2, 0.0, 0.0])
    done, fit = review_yaw(second, "now", a_belief(moved, 10.0))
    assert not is_under_review(done.track)
    np.testing.assert_allclose(fit.world_from_object.matrix(), (moved @ FLIPPED).matrix())


def test_a_yaw_that_was_right_is_kept_though_it_moved_meanwhile(task):
    begun, _ = review_yaw(task(None, interval_ns=PROPOSED_NS), "then", a_belief(SHARP, 40.0))
    now = a_belief(Pose.from_yaw(0.1), 10.0)
    second = task(begun.track.review, now_ns=PROPOSED_NS, interval_ns=LONG_NS)
    done, after = review_yaw(second, "now", now)
    assert after is now.fit
    assert done.track.review.in_vain == 1
    assert done.track.review.rival_nats == pytest.approx(10.0 + TURNED_NATS)


def test_a_review_begins_anew_when_the_camera_was_moved(task):
    begun, _ = review_yaw(task(None, interval_ns=PROPOSED_NS), "then", a_belief(SHARP, 10.0))
    moved = task(begun.track.review, now_ns=PERIOD_NS, interval_ns=PROPOSED_NS, rig=Pose.identity())
    again, fit = review_yaw(moved, "now", a_belief(SHARP, 10.0))
    assert again.track.review.pending.evidence == "now"
    assert fit.world_from_object is SHARP


def test_what_never_moved_is_left_alone_unless_its_place_says_less_than_before(task):
    weak = a_belief(SHARP, 10.0)
    resting = task(None, state=TrackState.STATIC)
    assert review_yaw(resting, None, weak)[1] is weak.fit
    assert review_yaw(resting, None, weak, is_shaken=True)[1].world_from_object is FLIPPED


def test_after_a_review_in_vain_the_next_waits_twice_as_long(task):
    weak, before = a_belief(SHARP, 10.0), Review(0, 2, 1.0, 1.0)
    early = task(before, now_ns=4 * PERIOD_NS - 1)
    assert review_yaw(early, None, weak)[0].track.review is before
    assert review_yaw(task(before, now_ns=4 * PERIOD_NS), None, weak)[1] is not weak.fit


def test_what_looks_like_its_appearance_memory_of_a_known_yaw_is_left_alone(task):
    seen = a_belief(SHARP, 10.0)
    seen.fit.textured = True
    seen.fit.reduced = SimpleNamespace(
        camera_from_object=None, appearance=SimpleNamespace(view_weight=lambda _: 1.0)
    )
    assert review_yaw(task(None), None, seen)[1] is seen.fit
    ambiguous = task(Review(0, 0, 0.0, 0.0), now_ns=10 * PERIOD_NS)
    assert review_yaw(ambiguous, None, seen)[1] is not seen.fit


def test_a_patterned_thing_taken_for_its_back_is_turned_round(table, as_scanned):
    """With the real comparison of yaws, on a filmed table."""
    true = table.poses["book-1"]
    flipped = Pose.from_yaw(true.yaw() + np.pi, true.translation)
    evidence = table.evidence(as_scanned, "book-1", flipped)
    prior = Prior(pose_vector(flipped), np.array([0.01, 0.01, 0.003, 0.1]))
    wrong = solve(evidence, table.models["book-1"], flipped, prior, table.renderer)
    scene = replace(as_scanned, frame=replace(as_scanned.frame, t_ns=LONG_NS))
    task = table.task(scene, "book-1", state=TrackState.TRACKED, world_from_object=flipped)
    observation = observe(scene, evidence)

    def belief(fit):
        pose = fit.world_from_object
        found = pose_support(observation, task.model, pose, table.renderer)
        return Belief(observation, fit, found, lambda: found)

    doubted = replace(task, track=replace(task.track, review=Review(-LONG_NS, 0, 0.0, 0.0)))
    after, fit = review_yaw(doubted, evidence, belief(wrong))
    while is_under_review(after.track):
        after, fit = review_yaw(after, evidence, belief(wrong))
    assert abs(np.degrees(wrap_angle(fit.world_from_object.yaw() - true.yaw()))) < 5.0
    assert fit.colour_correlation > wrong.colour_correlation + 0.2
    # What is right already stays as it is.
    kept = replace(task, track=replace(task.track, world_from_object=true))
    _, again = review_yaw(kept, evidence, belief(fit))
    assert abs(np.degrees(wrap_angle(again.world_from_object.yaw() - true.yaw()))) < 5.0
