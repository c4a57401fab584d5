"""A small thing's place and yaw by its colours, in a picture of its mesh."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from tracking.hypotheses.budget import NotYet, Pace
from tracking.hypotheses.patch_search import (
    SMALL_PX,
    hypotheses,
    is_recognised,
    is_small,
    refined,
    settled,
)


def told(table, seen, places, **pace):
    scene, _now = seen
    beside = table.neighbours("mug-1")
    return hypotheses(scene, table.models["mug-1"], beside, np.array(places), pace=Pace(**pace))


def test_the_best_guess_is_the_right_one_though_the_place_is_rough(table, mug_elsewhere):
    now = mug_elsewhere[1]
    rough = [np.add(now.translation, (dx, dy, 0.0)) for dx, dy in ((0.03, -0.02), (-0.3, 0.2))]
    best, *others = told(table, mug_elsewhere, rough)
    pose = best.world_from_object
    assert np.linalg.norm(pose.translation - now.translation) < 0.01
    assert abs(wrap_angle(pose.yaw() - now.yaw())) < math.radians(8)
    assert best.photometric_score > 0.4
    assert all(best.score >= other.score for other in others)


def test_where_nothing_is_nothing_is_a_good_guess(table, mug_elsewhere):
    left = table.poses["mug-1"].translation
    assert all(
        hypothesis.photometric_score < 0.3 for hypothesis in told(table, mug_elsewhere, [left])
    )


def test_no_places_are_no_guesses(table, mug_elsewhere):
    assert told(table, mug_elsewhere, np.zeros((0, 3))) == []


def test_what_does_not_fit_into_a_frame_waits(table, mug_elsewhere):
    now = mug_elsewhere[1].translation
    with pytest.raises(NotYet):
        told(table, mug_elsewhere, [now, np.add(now, (0.3, 0.0, 0.0))], budget_ms=7.0)


def test_a_thing_is_recognised_where_it_stands_and_nothing_else_for_it(table, mug_elsewhere):
    scene, now = mug_elsewhere
    mug = table.models["mug-1"]
    here = table.evidence(scene, "mug-1", now)
    assert is_recognised(scene, mug, here, SimpleNamespace(world_from_object=now))
    left = table.poses["mug-1"]
    there = table.evidence(scene, "mug-1", left)
    assert not is_recognised(scene, mug, there, SimpleNamespace(world_from_object=left))
    turned = Pose.from_yaw(now.yaw() + math.pi, now.translation)
    assert not is_recognised(scene, mug, here, SimpleNamespace(world_from_object=turned))


def test_a_rough_pose_is_refined_by_the_colours(table, mug_elsewhere):
    scene, now = mug_elsewhere
    rough = Pose.from_yaw(now.yaw() + 0.15, now.translation + np.array([0.01, 0.008, 0.0]))
    evidence = table.evidence(scene, "mug-1", rough)
    hypothesis = refined(scene, table.models["mug-1"], evidence, rough)
    assert hypothesis.photometric_score is not None
    before = np.linalg.norm(rough.translation - now.translation)
    assert (
        np.linalg.norm(hypothesis.world_from_object.translation - now.translation) < 0.75 * before
    )


def test_only_small_patterned_things_are_settled_by_their_colours(table, as_scanned):
    for name in ("book-1", "mug-1"):
        model, pose = table.models[name], table.poses[name]
        evidence = table.evidence(as_scanned, name, pose)
        # What is seen under fewer pixels than `SMALL_PX` is small.
        radius_px = evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
        small = is_small(model, evidence)
        assert small == (radius_px < SMALL_PX)
        fit = settled(as_scanned, model, evidence, pose)
        assert (fit is not None) == (small and model.textured)
    assert is_small(table.models["mug-1"], evidence)
