"""Refining a pose: by outline, by colours, and by climbing the likelihood itself."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from tracking.evidence.observation import observe
from tracking.hypotheses import refinement
from tracking.hypotheses.budget import BudgetExhausted, FrameBudget, Step
from tracking.hypotheses.refinement import CLIMB_STEP, climb, climb_if_clear, refine
from tracking.likelihood.pixel_model import PoseSupport
from tracking.likelihood.pose_likelihood import pose_support


@pytest.fixture
def seen(table, as_scanned):
    """A book's evidence, observation, model and true pose."""
    model, true = table.models["book-1"], table.poses["book-1"]
    evidence = table.evidence(as_scanned, "book-1", true)
    return as_scanned, evidence, observe(as_scanned, evidence), model, true


def beside(pose, model, steps, turn_rad):
    place = pose.translation + model.radius_m * np.array([*steps, 0.0])
    return Pose.from_yaw(pose.yaw() + turn_rad, place)


@pytest.mark.parametrize(("steps", "turn_rad"), [((0.2, 0.1), 0.1), ((-0.1, 0.2), -0.2)])
def test_a_climb_comes_near_from_where_a_refinement_may_start(seen, steps, turn_rad):
    scene, _, observation, model, true = seen
    start = beside(true, model, steps, turn_rad)
    found = climb(observation, model, start, scene)
    nats = [pose_support(observation, model, pose, scene.renderer).nats for pose in (start, found)]
    assert nats[1] > nats[0]
    assert np.linalg.norm(found.translation - true.translation) < 0.5 * np.linalg.norm(
        start.translation - true.translation
    )
    assert abs(wrap_angle(found.yaw() - true.yaw())) < abs(turn_rad)


def test_a_climb_stays_at_the_top(seen):
    scene, _, observation, model, true = seen
    top = climb(observation, model, true, scene)
    again = climb(observation, model, top, scene)
    assert np.linalg.norm(again.translation - top.translation) < CLIMB_STEP * model.radius_m / 4


@pytest.mark.parametrize("aside", [(0.3, 0.0, 0.0), (0.0, -0.25, 0.0), (0.0, 0.0, 0.3)])
def test_what_a_solver_left_astray_is_climbed_from_even_if_it_is_in_the_air(seen, aside):
    scene, _, observation, model, true = seen
    start = Pose(true.rotation, true.translation + model.radius_m * np.array(aside))
    found = climb_if_clear(
        observation, model, world_from_start=start, scene=scene, log_prior=lambda pose: 0.0
    )
    apart = np.linalg.norm(found.translation - true.translation)
    assert apart < 0.4 * np.linalg.norm(start.translation - true.translation)


def test_what_is_as_likely_as_all_beside_it_stays(seen):
    scene, _, observation, model, true = seen
    at = {"scene": scene, "log_prior": lambda pose: 0.0}
    assert climb_if_clear(observation, model, world_from_start=true, **at) is None
    astray = Pose(true.rotation, true.translation + model.radius_m * np.array([0.3, 0.0, 0.0]))

    def never_back(pose):
        return 0.0 if pose is astray else -math.inf

    at["log_prior"] = never_back
    assert climb_if_clear(observation, model, world_from_start=astray, **at) is None


@pytest.mark.parametrize(("samples", "climbs"), [(202.0, True), (184.0, False)])
def test_what_is_followed_too_near_the_eye_has_as_many_nats_of_more_pixels(
    seen, monkeypatch, samples, climbs
):
    """An armchair that is pushed was followed 15 cm before its place, with 141 of 168 nats."""
    scene, _, observation, model, true = seen
    there = PoseSupport(168.0, 182.0, 1.0, 0.9, 0.0, 9000.0)
    astray = Pose(true.rotation, true.translation + model.radius_m * np.array([0.3, 0.0, 0.0]))

    def supports(*_, poses, **__):
        share = [np.linalg.norm(p.translation - true.translation) / model.radius_m for p in poses]
        share = [min(apart / 0.3, 1.0) for apart in share]
        return [
            replace(there, nats=168.0 - 27.0 * s, samples=182.0 + (samples - 182.0) * s)
            for s in share
        ]

    monkeypatch.setattr(refinement, "pose_supports", supports)
    at = {"scene": scene, "log_prior": lambda pose: 0.0}
    found = climb_if_clear(observation, model, world_from_start=astray, **at)
    assert (found is not None) == climbs


def test_a_refinement_spread_over_frames_comes_to_the_same(seen):
    scene, evidence, observation, model, true = seen
    start = beside(true, model, (0.1, 0.0), math.radians(6))
    at_once = refine(scene, model, start, evidence, observation)
    done, frames = (), 0
    while True:
        budget, frames = FrameBudget(Step.SOLVE.nominal_ms, done), frames + 1
        try:
            found = refine(scene, model, start, evidence, observation, budget=budget)
            break
        except BudgetExhausted:
            done = budget.done()
    assert frames >= 3
    np.testing.assert_array_equal(
        found.world_from_object.matrix(), at_once.world_from_object.matrix()
    )
