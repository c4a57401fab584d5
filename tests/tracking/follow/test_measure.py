"""Measuring an object in a frame: where it is expected, or somewhere around."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import tracking.follow.measure
from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.evidence.appearance_memory import remember_appearance
from tracking.evidence.observation import observe
from tracking.evidence.rendering import draw
from tracking.follow.local_search import Found
from tracking.follow.measure import Seen, measure
from tracking.follow.posterior import is_accepted, is_conclusive
from tracking.hypotheses.refinement import fit_at
from tracking.solve.gauss_newton import Prior
from tracking.solve.motion import pose_vector

STANDING = np.array([0.1, 0.1, 0.003, 0.25])
CARRIED = np.array([0.1, 0.1, 0.08, 0.25])
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


def test_the_first_centimetres_of_a_lift_are_no_slide(table, as_scanned):
    """Along the sight both have one outline; what was still for long is rarely in a hand."""
    stood, model = table.poses["book-1"], table.models["book-1"]
    eye = as_scanned.world_from_rig.translation

    def at_height(metres):
        away = stood.translation + np.array([0.0, 0.0, 0.03]) - eye
        share = (stood.translation[2] + metres - eye[2]) / away[2]
        return Pose(stood.rotation, eye + share * away)

    def likelier(scene, low, high):
        task = table.task(scene, "book-1", **MOVES | {"still_frames": 6})
        evidence = table.evidence(scene, "book-1", low)
        found = [
            Found(fit_at(scene, model, evidence, pose), Prior(pose_vector(stood), sigma))
            for pose, sigma in ((low, STANDING), (high, CARRIED))
        ]
        window = Seen(evidence, observe(scene, evidence))
        first, second = found
        chosen = tracking.follow.measure._likelier(task, window, first=first, second=second)
        return chosen is second

    slid, lifted = at_height(0.0), at_height(0.03)
    assert likelier(table.scene({"book-1": lifted}), slid, lifted)
    assert not likelier(table.scene({"book-1": slid}), slid, lifted)
    # Nothing is carried below what it stands on, however well it fits there.
    sunk = at_height(-0.02)
    assert not likelier(table.scene({"book-1": sunk}), slid, sunk)


@pytest.mark.parametrize(
    ("height_m", "down", "up", "is_carried"),
    [
        (0.03, 30.0, 34.0, True),
        (0.03, 34.0, 30.0, False),
        # A chair that is pushed over the floor has a little more nats in the air.
        (0.45, 30.0, 34.0, False),
        (0.45, 24.0, 34.0, True),
    ],
)
def test_what_is_tall_stays_on_its_support_until_it_shows_clearly_more_in_the_air(
    table, as_scanned, monkeypatch, height_m, down, up, is_carried
):
    stood, model = table.poses["book-1"], table.models["book-1"]
    source = replace(model.source, box_m=(*model.source.box_m[:2], height_m))
    task = table.task(as_scanned, "book-1", **MOVES)
    task = replace(task, model=replace(model, source=source))
    evidence = table.evidence(as_scanned, "book-1", stood)
    lifted = Pose(stood.rotation, stood.translation + np.array([0.0, 0.0, 0.05]))
    standing, carried = (
        Found(fit_at(as_scanned, model, evidence, pose), Prior(pose_vector(stood), sigma))
        for pose, sigma in ((stood, STANDING), (lifted, CARRIED))
    )
    supports = [SimpleNamespace(nats=nats) for nats in (down, up)]
    monkeypatch.setattr(tracking.follow.measure, "pose_supports", lambda *_, **__: supports)
    window = Seen(evidence, observe(as_scanned, evidence))
    found = tracking.follow.measure._likelier(task, window, first=standing, second=carried)
    assert (found is carried) == is_carried
