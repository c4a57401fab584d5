"""Measuring an object in a frame: where it is expected, or somewhere around."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.evidence.appearance_memory import remember_appearance
from tracking.evidence.observation import observe
from tracking.evidence.rendering import draw
from tracking.follow.measure import Seen, measure
from tracking.follow.posterior import is_accepted, is_conclusive

MOVES = {"state": TrackState.TRACKED, "still_frames": 0, "confidence": 0.9}


def measured(table, scene, name, predicted, *, is_unchanged=False, **remembered):
    task = table.task(scene, name, **remembered)
    evidence = table.evidence(scene, name, predicted)
    seen = Seen(evidence, observe(scene, evidence))
    window, fit = measure(task, seen, predicted, is_unchanged=is_unchanged)
    return task, evidence, window.evidence, fit


def off(fit, true):
    found = fit.world_from_object
    metres = float(np.linalg.norm(found.translation - true.translation))
    return metres, abs(math.degrees(wrap_angle(found.yaw() - true.yaw())))


@pytest.mark.parametrize("name", ["book-1", "box-1"])
def test_what_rests_is_measured_where_it_is(table, as_scanned, name):
    true = table.poses[name]
    task, evidence, window, fit = measured(table, as_scanned, name, true)
    assert window is evidence
    metres, degrees = off(fit, true)
    assert metres < 0.010
    assert degrees < 3.0
    assert is_accepted(fit)
    assert is_conclusive(task, fit)


@pytest.mark.parametrize(("dx", "dy", "yaw_deg"), [(0.03, 0.0, 8.0), (-0.02, 0.03, -10.0)])
def test_what_moves_is_found_though_it_is_not_quite_where_it_was_expected(
    table, as_scanned, dx, dy, yaw_deg
):
    true = table.poses["book-1"]
    expected = Pose.from_yaw(
        true.yaw() + math.radians(yaw_deg), true.translation + np.array([dx, dy, 0.0])
    )
    _task, _evidence, _window, fit = measured(table, as_scanned, "book-1", expected, **MOVES)
    metres, degrees = off(fit, true)
    assert metres < 0.010
    assert degrees < 3.0


def test_what_is_gone_is_not_believed(table, no_mug):
    true = table.poses["mug-1"]
    task, _evidence, _window, fit = measured(table, no_mug, "mug-1", true, **MOVES)
    assert not is_accepted(fit)
    assert not is_conclusive(task, fit)


def test_what_looks_as_it_did_when_it_rested_has_not_moved(table, as_scanned):
    true, model = table.poses["book-1"], table.models["book-1"]
    evidence = table.evidence(as_scanned, "book-1", true)
    drawn = draw(model, true, evidence, table.renderer)
    memory = replace(
        remember_appearance(evidence, drawn, true, radius_m=model.radius_m), colour_correlation=0.5
    )
    near = Pose(true.rotation, true.translation + np.array([0.02, 0.01, 0.0]))
    known = {**MOVES, "appearance": memory, "missed_frames": 1}
    _task, _evidence, _window, fit = measured(table, as_scanned, "book-1", near, **known)
    np.testing.assert_array_equal(fit.world_from_object.matrix(), true.matrix())
    # The appearance of something carried says nothing about where it rests.
    known["appearance"] = replace(memory, was_at_rest=False)
    _task, _evidence, _window, fit = measured(table, as_scanned, "book-1", near, **known)
    assert (fit.world_from_object.matrix() != true.matrix()).any()
    assert off(fit, true)[0] < 0.010
