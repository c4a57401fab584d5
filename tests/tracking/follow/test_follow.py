"""What follows an object from frame to frame may cost no more than a frame has time for."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.evidence.evidence import gather, view_of
from tracking.follow import follow as follow_module
from tracking.follow.belief import Belief
from tracking.follow.follow import follow
from tracking.hypotheses.refinement import fit_at
from tracking.likelihood.pixel_model import PoseSupport
from tracking.solve.motion import Motion

SECOND_NS = 1_000_000_000
SAMPLES = 36.0


@pytest.fixture
def compared(monkeypatch):
    """Times at which a moving object's pose was compared with those beside it."""
    times_ns = []

    def noted(task, belief, **_):
        times_ns.append(task.scene.frame.t_ns)
        return belief

    monkeypatch.setattr(follow_module, "climb_beside", noted)
    return times_ns


DOUBTFUL, SURE = 10.0, 0.1
"""Nats a sample that it usually shows: far more than a mug does, and far less."""


def follow_for_a_second(table, mug_elsewhere, *, fps=10, may_compare=True, usual_rate=DOUBTFUL):
    scene, now = mug_elsewhere
    aside = Pose(now.rotation, now.translation + np.array([0.004, 0.0, 0.0]))
    track = table.task(scene, "mug-1").track
    for index in range(1, fps + 1):
        t_ns = index * SECOND_NS // fps
        # It moves on and on: what is still comes to rest, and is not compared.
        remembered = replace(
            track,
            world_from_object=aside,
            state=TrackState.TRACKED,
            was_at_rest=False,
            still_frames=0,
            usual_rate=usual_rate,
        )
        task = replace(
            table.task(replace(scene, frame=replace(scene.frame, t_ns=t_ns)), "mug-1"),
            track=replace(remembered, motion=Motion.rest(t_ns)),
            may_compare=may_compare,
            interval_ns=SECOND_NS // fps,
        )
        track = follow(task, unchanged=False)
    return track


@pytest.mark.parametrize(("fps", "least", "most"), [(10, 10, 10), (30, 9, 11)])
def test_poses_beside_a_doubtful_one_are_compared_ten_times_a_second(
    table, mug_elsewhere, compared, fps, least, most
):
    follow_for_a_second(table, mug_elsewhere, fps=fps)
    assert least <= len(compared) <= most


def test_they_wait_where_another_object_had_its_turn(table, mug_elsewhere, compared):
    track = follow_for_a_second(table, mug_elsewhere, may_compare=False)
    assert compared == []
    assert track.compared_ns == 0


@pytest.mark.parametrize("fps", [10, 30])
def test_one_that_shows_as_much_as_usual_is_compared_twice_a_second(
    table, mug_elsewhere, compared, fps
):
    """What was followed wrongly for long shows as usual, too."""
    follow_for_a_second(table, mug_elsewhere, fps=fps, usual_rate=SURE)
    assert len(compared) == 2


def test_where_a_moving_one_was_is_weighed_only_if_it_is_doubtful(
    table, mug_elsewhere, compared, monkeypatch
):
    weighed = []
    weigh = follow_module.weigh_measurement

    def noted(*belief_of):
        belief = weigh(*belief_of)
        return replace(belief, weigh_before=lambda: weighed.append(1) or belief.before)

    monkeypatch.setattr(follow_module, "weigh_measurement", noted)
    follow_for_a_second(table, mug_elsewhere, usual_rate=SURE)
    assert weighed == []


@pytest.mark.parametrize("state", [TrackState.STATIC, TrackState.OCCLUDED])
@pytest.mark.parametrize(
    ("found", "before", "moves"),
    [
        # In doubt nowhere but at its place, where it shows no more.
        (40.0, 5.0, True),
        # Somebody in its colours stands before it: it usually shows twice as much.
        (20.0, 12.0, False),
        # As much in another light or hand, once the empty room shows where it stood.
        (20.0, -10.0, True),
        # Whoever hides it says as much for its place as for another.
        (32.0, 31.0, False),
    ],
)
def test_what_rests_or_is_hidden_there_moves_only_to_where_it_is_in_no_doubt(
    table, mug_elsewhere, monkeypatch, state, found, before, moves
):
    scene, now = mug_elsewhere
    task = table.task(scene, "mug-1")
    usual = PoseSupport(40.0, SAMPLES, 1.0, 1.0, 0.0, 900.0)
    track = replace(task.track, state=state, usual_nats=usual.nats, usual_rate=usual.nats_a_sample)

    def weighed(task, observation, fit):
        evidence = gather(
            task.scene, task.model, view_of(task.scene, task.model, now), task.neighbours
        )
        there, here = (replace(usual, nats=nats) for nats in (found, before))
        at_once = fit_at(task.scene, task.model, evidence, now)
        return Belief(observation, at_once, there, lambda: here)

    monkeypatch.setattr(follow_module, "weigh_measurement", weighed)
    after = follow(replace(task, track=track), unchanged=False)
    apart = after.world_from_object.translation - track.world_from_object.translation
    assert (float(np.linalg.norm(apart)) > 0.001) == moves
    assert after.was_at_rest != moves


@pytest.mark.parametrize(
    ("before", "size", "moves"), [(17.0, 1.0, False), (14.0, 1.0, True), (14.0, 1.2, False)]
)
def test_what_moves_goes_only_where_it_is_likelier_than_where_it_was(
    table, mug_elsewhere, compared, monkeypatch, before, size, moves
):
    """A book that somebody had put down went 13 cm towards the camera, and stayed there.

    Another one, in the hand, went 25 cm: for as many nats of a sixth more pixels.
    """
    scene, now = mug_elsewhere
    task = table.task(scene, "mug-1", state=TrackState.TRACKED, was_at_rest=False, usual_nats=16.0)
    usual = PoseSupport(16.0, SAMPLES, 1.0, 1.0, 0.0, 900.0)
    evidence = gather(scene, task.model, view_of(scene, task.model, now), task.neighbours)
    elsewhere = fit_at(scene, task.model, evidence, now)

    def weighed(_task, observation, _fit):
        found, here = (replace(usual, nats=nats) for nats in (15.0, before))
        nearer = replace(found, samples=size * found.samples)
        return Belief(observation, elsewhere, nearer, lambda: here)

    monkeypatch.setattr(follow_module, "weigh_measurement", weighed)
    after = follow(task, unchanged=False)
    apart = after.world_from_object.translation - task.track.world_from_object.translation
    assert (float(np.linalg.norm(apart)) > 0.05) == moves


@pytest.mark.parametrize(("turned", "moves"), [(36.0, True), (28.0, False)])
def test_what_rests_is_turned_on_the_spot_only_where_it_shows_as_much_as_usual(
    table, mug_elsewhere, monkeypatch, turned, moves
):
    """A passer-by before an armchair resembled one turned by half, 45 cm beside its place."""
    scene, now = mug_elsewhere
    task = table.task(scene, "mug-1")
    usual = PoseSupport(40.0, SAMPLES, 1.0, 1.0, 0.0, 900.0)
    track = replace(task.track, usual_nats=usual.nats, usual_rate=usual.nats_a_sample)
    evidence = gather(scene, task.model, view_of(scene, task.model, now), task.neighbours)
    other = fit_at(scene, task.model, evidence, now)

    def weighed(_task, observation, fit):
        found, here = (replace(usual, nats=n) for n in (turned if fit is other else 12.0, 12.0))
        return Belief(observation, fit, found, lambda: here)

    monkeypatch.setattr(follow_module, "weigh_measurement", weighed)
    monkeypatch.setattr(follow_module, "review_yaw", lambda task, *_, **__: (task, other))
    after = follow(replace(task, track=track), unchanged=False)
    apart = after.world_from_object.translation - track.world_from_object.translation
    assert (float(np.linalg.norm(apart)) > 0.05) == moves
