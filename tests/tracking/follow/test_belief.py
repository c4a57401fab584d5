"""Decisions on an object by the odds of a frame."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.evidence.observation import observe
from tracking.follow.belief import (
    MIN_SAMPLES,
    STAYS_NATS,
    Belief,
    at_first,
    at_pose,
    confidence_of,
    hypothesis_of,
    is_at_rest_still,
    is_followed,
    is_shaken,
    weigh_measurement,
)
from tracking.hypotheses.hypothesis import CLEAR_NATS
from tracking.hypotheses.refinement import fit_at
from tracking.likelihood.pixel_model import PoseSupport


def support(nats, samples=20.0):
    return PoseSupport(nats, samples, 1.0, 0.5, 0.0, 900.0)


def belief(found, before, samples=20.0):
    return Belief(None, None, support(found, samples), lambda: support(before, samples))


def a_task(usual):
    return SimpleNamespace(track=SimpleNamespace(usual_nats=usual, missed_frames=0))


@pytest.mark.parametrize(
    ("found", "before", "usual", "is_doubtful", "rests"),
    [
        (20.0, 20.5, 20.0, False, True),
        (20.0, 16.5, 20.0, False, False),
        (20.0, 16.5, 20.0, True, False),
        (19.0, 16.5, 20.0, True, True),
        # Nothing has changed where it stands.
        (20.0, 19.0, 20.0, False, True),
        # Neither pose accounts for what changed: somebody stands before it.
        (8.0, 6.0, 20.0, False, True),
        (12.0, 6.0, 20.0, False, False),
        (13.1, 6.0, 20.0, False, False),
        # What passers-by and a model's own faults say for a pose beside it grows with its size.
        (91.0, 81.0, 194.0, False, True),
        (150.0, 81.0, 194.0, False, False),
        # It has left, and is half hidden where it is now.
        (5.0, -12.0, 20.0, False, False),
    ],
)
def test_a_resting_object_moves_only_where_the_odds_say_so(
    found, before, usual, is_doubtful, rests
):
    decided = is_at_rest_still(a_task(usual), belief(found, before), is_doubtful=is_doubtful)
    assert decided is rests


def test_what_shows_half_of_what_it_showed_is_followed_and_after_a_gap_only_if_recognised():
    track = SimpleNamespace(usual_nats=4.0, missed_frames=0)
    assert is_followed(track, belief(2.1, 0.0))
    assert not is_followed(track, belief(1.9, 0.0))
    gone_on = SimpleNamespace(usual_nats=40.0, missed_frames=0)
    assert is_followed(gone_on, belief(CLEAR_NATS + 0.1, 0.0))
    missed = SimpleNamespace(usual_nats=4.0, missed_frames=2)
    assert not is_followed(missed, belief(2.1, 0.0))
    assert is_followed(missed, belief(CLEAR_NATS + 0.1, 0.0))


def test_what_is_hardly_in_view_is_unseen_and_what_shows_the_room_has_left():
    assert belief(1.0, 1.0, MIN_SAMPLES - 0.1).is_unseen
    assert not belief(1.0, 1.0, MIN_SAMPLES + 0.1).is_unseen
    assert belief(-STAYS_NATS - 0.1, -9.0).has_left
    assert not belief(0.0, -9.0).has_left
    track = SimpleNamespace(usual_nats=10.0)
    assert is_shaken(track, belief(9.0, 10.0 - CLEAR_NATS - 0.1))
    assert not is_shaken(track, belief(9.0, 9.0))


def test_confidence_is_a_posterior():
    assert confidence_of(support(30.0), math.inf) == pytest.approx(1.0)
    assert confidence_of(support(30.0), 0.0) == pytest.approx(0.5)
    assert confidence_of(support(-STAYS_NATS), math.inf) == pytest.approx(0.5)
    assert confidence_of(support(0.0), math.inf) < confidence_of(support(3.0), math.inf)
    assert confidence_of(support(-500.0), -500.0) == pytest.approx(0.0, abs=1e-20)


def first(table, scene, name, pose):
    """The first belief about an object that is taken to be at a pose."""
    task = table.task(scene, name, world_from_object=pose, state=TrackState.STATIC)
    evidence = table.evidence(scene, name, pose)
    observation = observe(scene, evidence)
    fit = fit_at(scene, task.model, evidence, pose)
    return task, evidence, weigh_measurement(task, observation, fit)


@pytest.mark.parametrize("name", ["book-1", "box-1", "mug-1"])
def test_in_the_first_frame_what_stands_where_it_was_scanned_is_known(table, as_scanned, name):
    task, evidence, known = first(table, as_scanned, name, table.poses[name])
    after = at_first(task, evidence, known)
    assert after is not None
    assert after.found.nats > CLEAR_NATS
    assert hypothesis_of(after).support is after.found


def test_in_the_first_frame_what_is_gone_or_turned_is_searched_for(table, as_scanned, no_mug):
    task, evidence, known = first(table, no_mug, "mug-1", table.poses["mug-1"])
    assert known.has_left
    assert at_first(task, evidence, known) is None
    true = table.poses["book-1"]
    turned = Pose.from_yaw(true.yaw() + math.pi, true.translation)
    task, evidence, known = first(table, as_scanned, "book-1", turned)
    assert at_first(task, evidence, known) is None


def test_a_belief_can_be_put_back_to_another_pose(table, as_scanned):
    true = table.poses["book-1"]
    beside = Pose(true.rotation, true.translation + np.array([0.03, 0.0, 0.0]))
    task, evidence, wrong = first(table, as_scanned, "book-1", beside)
    right = at_pose(task, evidence, wrong, true)
    np.testing.assert_array_equal(right.fit.world_from_object.matrix(), true.matrix())
    assert right.found.nats > wrong.found.nats


def test_a_pose_that_is_out_of_the_question_has_no_confidence_and_breaks_nothing():
    impossible = PoseSupport(-5000.0, 600.0, 1.0, 0.0, 0.0, 50000.0)
    certain = PoseSupport(5000.0, 600.0, 1.0, 1.0, 0.0, 50000.0)
    assert confidence_of(impossible, math.inf) < 1e-9
    assert confidence_of(certain, -5000.0) < 1e-9
    assert confidence_of(certain, math.inf) > 1.0 - 1e-9
