"""Small things that were lost on a table are found again by their colours, in filmed meshes."""

import time
from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.beside.messages import encoded
from tracking.beside.runner import SearchBesideFrames
from tracking.evidence.observation import observe
from tracking.follow.rebirth import awaiting_look
from tracking.follow.redetection import (
    HIDDEN_FRAMES,
    heights_of,
    is_missing,
    redetect,
    redetect_all,
)
from tracking.follow.track import SEARCH_PERIOD_NS, PendingReview, Review
from tracking.hypotheses.budget import Step
from tracking.hypotheses.hypothesis import CLEAR_NATS
from tracking.hypotheses.refinement import fit_at
from tracking.hypotheses.search_runner import Progress
from tracking.likelihood.pose_likelihood import pose_support

PAIR = ("mug-1", "box-1")
LOST = {"state": TrackState.LOST}


def apart(found, true):
    """Metres and degrees."""
    metres = float(np.linalg.norm(found.translation - true.translation))
    return metres, abs(np.degrees(wrap_angle(found.yaw() - true.yaw())))


def test_a_small_plain_thing_put_elsewhere_is_found_at_its_place_and_yaw(table, mug_elsewhere):
    scene, now = mug_elsewhere
    found = redetect_all([table.task(scene, "mug-1", **LOST)])["mug-1"]
    metres, degrees = apart(found.world_from_object, now)
    assert metres < 0.01
    assert degrees < 8.0
    # What a search found is confirmed in the next frame.
    assert found.state is TrackState.TRACKED
    assert found.rest is None
    assert found.usual_nats > CLEAR_NATS
    assert found.world_from_object.translation[2] == pytest.approx(0.74, abs=0.005)


def test_two_lost_things_are_not_given_one_place(table, mug_elsewhere):
    scene, now = mug_elsewhere
    both = ("book-1", "mug-1")
    tasks = [table.task(scene, n, neighbours=table.neighbours(n, both), **LOST) for n in both]
    found = redetect_all(tasks)
    assert apart(found["mug-1"].world_from_object, now)[0] < 0.01
    assert apart(found["book-1"].world_from_object, now)[0] > table.models["mug-1"].radius_m


@pytest.mark.parametrize("place", [(-0.22, 0.25, 0.74), (-0.37, 0.37, 0.74)])
def test_a_book_is_not_taken_for_one_on_the_floor_that_the_table_hides(table, place):
    now = Pose.from_yaw(table.poses["book-1"].yaw() + 0.8 * (place[0] < -0.3), place)
    found = redetect_all([table.task(table.scene({"book-1": now}), "book-1", **LOST)])["book-1"]
    assert found.state is not TrackState.LOST
    assert apart(found.world_from_object, now)[0] < 0.01


def test_what_is_not_in_the_room_stays_lost_and_the_search_is_noted(table, no_mug):
    found = redetect_all([table.task(no_mug, "mug-1", **LOST)])["mug-1"]
    assert found.state is TrackState.LOST
    assert found.confidence == 0.0
    assert found.searches_in_vain == 1
    assert found.searched_ns == no_mug.frame.t_ns
    assert redetect_all([]) == {}


def test_a_search_spread_over_frames_comes_to_the_same_pose(table, mug_elsewhere):
    scene, _now = mug_elsewhere
    task = table.task(scene, "mug-1", **LOST)
    at_once = redetect_all([task])["mug-1"]
    search, found, frames = None, {}, 0
    while not found:
        found, search = redetect([task], search, budget_ms=60.0)
        frames += 1
    assert frames >= 3
    assert search is None
    np.testing.assert_array_equal(
        found["mug-1"].world_from_object.matrix(), at_once.world_from_object.matrix()
    )


def test_a_search_beside_the_frames_comes_to_the_same_pose_to_the_bit(table, mug_elsewhere):
    scene, _now = mug_elsewhere
    task = table.task(scene, "mug-1", **LOST)
    at_once = redetect_all([task])["mug-1"]
    runner = SearchBesideFrames()
    try:
        search, found, until = None, {}, time.monotonic() + 120.0
        while not found and time.monotonic() < until:
            found, search = redetect([task], search, budget_ms=1.0, runner=runner)
            time.sleep(0.02)
    finally:
        runner.close()
    assert search is None
    there, here = found["mug-1"], at_once
    np.testing.assert_array_equal(there.world_from_object.matrix(), here.world_from_object.matrix())
    np.testing.assert_array_equal(there.covariance, here.covariance)
    assert there.confidence == here.confidence


def test_what_has_gone_on_by_the_end_of_a_search_is_not_where_it_was_found(
    table, mug_elsewhere, no_mug
):
    scene, then = mug_elsewhere
    now_ns = scene.frame.t_ns + 1_500_000_000
    later = replace(no_mug, frame=replace(no_mug.frame, t_ns=now_ns))
    begun = table.task(scene, "mug-1", **LOST)
    gone = table.task(later, "mug-1", usual_nats=20.0, **LOST)
    found, search = redetect([begun], None, budget_ms=30.0)
    while not found:
        found, search = redetect([gone], search, budget_ms=60.0)
    track = found["mug-1"]
    assert track.state is TrackState.LOST
    assert track.searches_in_vain == 1
    # It was there: that is where it is looked for from now on.
    assert apart(track.world_from_known, then)[0] < 0.01
    assert (track.known_ns, track.missing_ns) == (scene.frame.t_ns, now_ns)
    assert awaiting_look([replace(gone, track=track)], None) == {"mug-1"}


def test_a_search_of_what_was_under_review_can_be_ordered(table, mug_elsewhere):
    scene, _now = mug_elsewhere
    model, pose = table.models["mug-1"], table.poses["mug-1"]
    evidence = table.evidence(scene, "mug-1", pose)
    observation = observe(scene, evidence)
    fit = fit_at(scene, model, evidence, pose)
    support = pose_support(observation, model, pose, scene.renderer)
    pending = PendingReview(scene, evidence, observation, fit, support, ())
    task = table.task(scene, "mug-1", **LOST, review=Review(0, 0, 0.0, 0.0, pending))
    with pytest.raises(TypeError, match="cannot pickle"):
        encoded(task)
    _, begun = redetect([task], None, budget_ms=1.0)
    assert begun is not None
    encoded(begun.task)


def test_a_search_that_is_not_needed_any_more_is_given_up(table, mug_elsewhere):
    given_up = []

    class Waits:
        def advance(self, progress, work, *, budget_ms):
            return Progress(number=5), None

        def give_up(self, progress):
            given_up.append(progress.number)

    scene, _now = mug_elsewhere
    _, begun = redetect([table.task(scene, "mug-1", **LOST)], None, budget_ms=1.0, runner=Waits())
    redetect([], begun, budget_ms=1.0, runner=Waits())
    assert given_up == [5]


def test_a_search_ends_when_its_object_is_lost_no_more(table, mug_elsewhere):
    scene, _now = mug_elsewhere
    mug = table.task(scene, "mug-1", **LOST)
    _, begun = redetect([mug], None, budget_ms=Step.LOOK.nominal_ms + 1.0)
    assert begun is not None
    assert begun.task.model is mug.model
    found, left = redetect([], begun, budget_ms=Step.LOOK.nominal_ms + 1.0)
    assert (found, left) == ({}, None)


@pytest.mark.parametrize(("in_vain", "waits"), [(0, 1), (1, 1), (2, 2), (3, 4), (9, 8)])
def test_after_searches_in_vain_the_next_waits_longer(table, no_mug, in_vain, waits):
    remembered = {**LOST, "searches_in_vain": in_vain, "searched_ns": 0}
    for late_ns, begins in ((-1, False), (0, True)):
        now = waits * SEARCH_PERIOD_NS + late_ns
        scene = replace(no_mug, frame=replace(no_mug.frame, t_ns=now))
        _, search = redetect([table.task(scene, "mug-1", **remembered)], None, budget_ms=1.0)
        assert (search is not None) == begins


def test_what_waited_longest_is_looked_for_first(table, no_mug):
    early, late = -3 * SEARCH_PERIOD_NS, -2 * SEARCH_PERIOD_NS
    tasks = [
        table.task(no_mug, "mug-1", **LOST, searched_ns=late),
        table.task(no_mug, "box-1", **LOST, searched_ns=early),
    ]
    _, search = redetect(tasks, None, budget_ms=1.0)
    assert search is not None
    assert search.task.model is tasks[1].model


def test_no_search_begins_for_what_is_looked_for_around_its_place(table, no_mug):
    tasks = [table.task(no_mug, name, **LOST, searched_ns=-9 * SEARCH_PERIOD_NS) for name in PAIR]
    _, search = redetect(tasks, None, budget_ms=1.0, looked_for={"mug-1"})
    assert search is not None
    assert search.task.model is tasks[1].model
    assert redetect(tasks, None, budget_ms=1.0, looked_for=PAIR) == ({}, None)


def test_what_is_hidden_for_long_is_looked_for(table, no_mug):
    def hidden(frames):
        return table.task(
            no_mug, "mug-1", state=TrackState.OCCLUDED, missed_frames=frames, usual_nats=0.0
        ).track

    assert is_missing(hidden(HIDDEN_FRAMES))
    assert not is_missing(hidden(HIDDEN_FRAMES - 1))


def test_what_was_never_seen_waits_for_what_is_lost(table, no_mug):
    unseen = {"state": TrackState.OCCLUDED, "missed_frames": HIDDEN_FRAMES, "usual_nats": 0.0}
    task = table.task(no_mug, "mug-1", **unseen, searched_ns=-3 * SEARCH_PERIOD_NS)
    _, alone = redetect([task], None, budget_ms=1.0)
    assert alone is not None
    assert alone.task.model is task.model
    lost = table.task(no_mug, "box-1", **LOST, searched_ns=-2 * SEARCH_PERIOD_NS)
    for begun in (None, alone):
        _, search = redetect([task, lost], begun, budget_ms=1.0)
        assert search is not None
        assert search.task.model is lost.model


@pytest.mark.parametrize("shows_all", [True, False])
def test_what_was_never_seen_comes_out_only_where_all_of_it_shows(
    table, mug_elsewhere, monkeypatch, shows_all
):
    scene, now = mug_elsewhere
    unseen = {"state": TrackState.OCCLUDED, "missed_frames": HIDDEN_FRAMES, "usual_nats": 0.0}
    task = table.task(scene, "mug-1", **unseen)
    monkeypatch.setattr("tracking.follow.redetection.is_sure", lambda rate: shows_all)
    found = redetect_all([task])["mug-1"]
    assert (apart(found.world_from_object, now)[0] < 0.01) == shows_all
    assert (found.state is TrackState.OCCLUDED) != shows_all


@pytest.mark.parametrize(
    ("height_m", "stood_at_m", "is_anywhere"),
    [(0.1, 0.0, True), (0.9, 0.0, False), (0.44, 0.74, True)],
)
def test_only_what_is_tall_and_stood_on_the_floor_stays_at_its_height(
    table, mug_elsewhere, height_m, stood_at_m, is_anywhere
):
    scene, _ = mug_elsewhere
    task = table.task(scene, "mug-1", **LOST)
    source = replace(task.model.source, box_m=(0.2, 0.2, height_m), support_z_m=stood_at_m)
    heights = heights_of(replace(task, model=replace(task.model, source=source)))
    assert heights == (scene.support_planes.heights_m if is_anywhere else (stood_at_m,))
