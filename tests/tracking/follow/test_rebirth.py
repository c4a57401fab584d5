"""A look around where an object was known for what its pose does not account for."""

import time
from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.beside.runner import SearchBesideFrames
from tracking.evidence.evidence import gather, view_of
from tracking.evidence.observation import observe
from tracking.follow.belief import MIN_RATE, accounts_for, weigh_measurement
from tracking.follow.follow import follow
from tracking.follow.outcome import miss
from tracking.follow.posterior import WIDEST_CARRIED_M
from tracking.follow.rebirth import FARTHEST_M, awaiting_look, expected_of, look_around
from tracking.follow.redetection import Search
from tracking.follow.track import Review
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import Hypothesis
from tracking.hypotheses.refinement import fit_at
from tracking.hypotheses.search_runner import BEGUN, Progress
from tracking.likelihood.pixel_model import PoseSupport
from tracking.solve.motion import Motion

FRAME_NS, SECOND_NS = 100_000_000, 1_000_000_000


@pytest.fixture
def lifted(table):
    """The book as it is taken up and turned between two pictures, and its pose then."""
    before = table.poses["book-1"]
    now = Pose.from_yaw(before.yaw() + 0.6, before.translation + np.array([-0.15, 0.1, 0.15]))
    return table.scene({"book-1": now}, seq=1, t_ns=FRAME_NS), now


def lost_sight_of(table, scene, **remembered):
    """The task of a book that was known one picture before, and is not where it was."""
    known = {
        "state": TrackState.OCCLUDED,
        "missed_frames": 1,
        "usual_nats": 60.0,
        "usual_rate": 1.2,
        "world_from_known": table.poses["book-1"],
        "known_motion": Motion.rest(0),
    }
    return table.task(scene, "book-1", **{**known, **remembered})


def looked(tasks):
    """Tracks of who was looked for in one frame."""
    tracks, pending = look_around(tasks, None)
    assert pending is None
    return tracks


class Later:
    """Computes looks that end in the frame after the one in which they begin."""

    def __init__(self):
        self.given_up = []

    def advance(self, progress, work, *, budget_ms):
        return (Progress(number=7), None) if progress is BEGUN else (progress, work(FrameBudget()))

    def give_up(self, progress):
        self.given_up.append(progress.number)


def test_a_book_that_was_taken_up_and_turned_is_found_in_the_next_picture(table, lifted):
    scene, now = lifted
    track = looked([lost_sight_of(table, scene)])["book-1"]
    assert track.state is TrackState.TRACKED
    assert np.linalg.norm(track.world_from_object.translation - now.translation) < 0.05
    assert track.world_from_known is track.world_from_object
    assert track.known_ns == track.looked_ns == FRAME_NS
    # The way there says how fast it moves.
    assert np.linalg.norm(track.motion.velocity[:3]) > 0.5


def test_a_pose_that_went_a_little_astray_is_taken_back(table, as_scanned):
    """However near the right one is: what shows so much less is not the same."""
    right = table.poses["book-1"]
    aside = 0.2 * table.models["book-1"].radius_m
    astray = Pose(right.rotation, right.translation + np.array([aside, 0.0, 0.0]))
    scene = replace(as_scanned, frame=replace(as_scanned.frame, seq=1, t_ns=FRAME_NS))
    task = lost_sight_of(table, scene, world_from_object=astray, world_from_known=astray)
    track = looked([task])["book-1"]
    assert track.state is TrackState.TRACKED
    assert np.linalg.norm(track.world_from_object.translation - right.translation) < 0.3 * aside


def test_what_rests_unchanged_is_known_to_be_there(table, as_scanned):
    """Else the first look after it is taken up would reach as far as if it had been hidden."""
    scene = replace(as_scanned, frame=replace(as_scanned.frame, seq=9, t_ns=9 * FRAME_NS))
    shown = table.task(scene, "book-1", rate=1.2, usual_rate=1.2)
    hidden = table.task(scene, "book-1", rate=0.1, usual_rate=1.2)
    assert follow(shown, unchanged=True).known_ns == 9 * FRAME_NS
    assert follow(hidden, unchanged=True).known_ns == hidden.track.known_ns


def test_what_a_pose_accounts_for_is_not_looked_for(table, lifted):
    scene, _ = lifted
    followed = lost_sight_of(table, scene, state=TrackState.TRACKED, rate=1.0, sure_ns=FRAME_NS)
    resting = lost_sight_of(table, scene, state=TrackState.STATIC)
    alone = lost_sight_of(table, scene, usual_nats=1.0, missing_ns=FRAME_NS)
    assert looked([followed, resting, alone]) == {}
    assert looked([replace(followed, track=replace(followed.track, rate=0.1))])


def doubtful(table, scene, world_from_object, **remembered):
    """The task of a book that is followed at a pose which accounts for less than all of it."""
    followed = {
        "state": TrackState.TRACKED,
        "missed_frames": 0,
        "rate": 0.7,
        "usual_rate": 0.7,
        "usual_nats": 10.0,
        "world_from_object": world_from_object,
        "world_from_known": world_from_object,
    }
    return lost_sight_of(table, scene, **{**followed, **remembered})


def test_what_was_followed_wrongly_for_long_is_found_where_it_shows(table, lifted):
    scene, now = lifted
    track = looked([doubtful(table, scene, table.poses["book-1"])])["book-1"]
    assert np.linalg.norm(track.world_from_object.translation - now.translation) < 0.05
    assert track.sure_ns == FRAME_NS


def test_what_is_in_doubt_where_it_is_stays_and_is_looked_for_ever_more_rarely(table, as_scanned):
    book = table.poses["book-1"]

    def at(t_ns, **looked):
        frame = replace(as_scanned.frame, seq=t_ns // FRAME_NS, t_ns=t_ns)
        return doubtful(table, replace(as_scanned, frame=frame), book, **looked)

    track = looked([at(FRAME_NS)])["book-1"]
    assert track.world_from_object is book
    assert track.looked_ns == FRAME_NS
    # Four seconds of doubt at the last look: the next one is as long after it.
    long_ago = {"looked_ns": 40 * FRAME_NS}
    assert looked([at(70 * FRAME_NS, **long_ago)]) == {}
    assert looked([at(80 * FRAME_NS, **long_ago)])


def test_what_rests_is_not_looked_for_in_doubt(table, lifted):
    """A passer-by who covers most of it is no doubt: looked for, a chair went to his legs."""
    scene, _ = lifted
    resting = {"state": TrackState.STATIC, "review": Review(0, 0, 0.0, 0.0), "rate": 0.3}
    assert looked([doubtful(table, scene, table.poses["book-1"], **resting)]) == {}


@pytest.mark.parametrize(("rate", "is_sure"), [(1.1, True), (0.9, False)])
def test_what_rests_unchanged_is_as_sure_as_it_was(table, as_scanned, rate, is_sure):
    scene = replace(as_scanned, frame=replace(as_scanned.frame, seq=9, t_ns=9 * FRAME_NS))
    track = follow(table.task(scene, "book-1", rate=rate, usual_rate=rate), unchanged=True)
    assert track.sure_ns == (9 * FRAME_NS if is_sure else 0)


def test_what_is_where_it_was_stays_there(table, as_scanned):
    scene = replace(as_scanned, frame=replace(as_scanned.frame, seq=1, t_ns=FRAME_NS))
    task = lost_sight_of(table, scene)
    track = looked([task])["book-1"]
    assert track.world_from_object is task.track.world_from_object
    assert track.looked_ns == FRAME_NS


def test_looks_take_turns_and_wait_longer_the_longer_nothing_is_found(table, lifted):
    scene, _ = lifted
    cost_ns = lost_sight_of(table, scene).costs.cost_ms(Step.BIRTH) * 1e6
    just_looked = lost_sight_of(table, scene, looked_ns=FRAME_NS - round(cost_ns))
    assert looked([just_looked]) == {}
    long_ago = replace(scene, frame=replace(scene.frame, t_ns=1_500_000_000))
    # Looked for after 1.3 s, it is not looked for again before a quarter of that has gone by.
    assert looked([lost_sight_of(table, long_ago, looked_ns=1_300_000_000)]) == {}


def test_what_is_missed_after_a_gap_in_the_pictures_is_looked_for(table, lifted):
    """While a camera was cut off for 20 s a stool was pushed, and only searched for after that."""
    scene, now = lifted
    gap_ns = 20 * SECOND_NS
    after = replace(scene, frame=replace(scene.frame, t_ns=gap_ns))
    missed = lost_sight_of(table, after, missing_ns=gap_ns, looked_ns=FRAME_NS)
    found = looked([missed])["book-1"]
    assert found.state is TrackState.TRACKED
    assert np.linalg.norm(found.world_from_object.translation - now.translation) < 0.05
    # Others were looked for first.
    waited = {"missing_ns": gap_ns - 3 * SECOND_NS, "looked_ns": gap_ns - 4 * SECOND_NS}
    assert "book-1" in looked([lost_sight_of(table, after, **waited)])
    waited["looked_ns"] += 2 * SECOND_NS
    assert looked([lost_sight_of(table, after, **waited)]) == {}


def test_what_was_hidden_from_the_start_is_looked_for_once_somebody_came_near(table, lifted):
    """A stool behind a table was carried off, and only searched for in pictures seconds old."""
    scene, now = lifted
    hidden = {"usual_nats": 0.0, "usual_rate": 0.0}
    found = looked([lost_sight_of(table, scene, **hidden)])["book-1"]
    assert found.state is TrackState.TRACKED
    assert np.linalg.norm(found.world_from_object.translation - now.translation) < 0.05
    # Somebody came ten seconds ago, and the last look was just then: the next one waits.
    later = replace(scene, frame=replace(scene.frame, t_ns=10 * SECOND_NS))
    waits = {**hidden, "looked_ns": 10 * SECOND_NS - FRAME_NS}
    assert looked([lost_sight_of(table, later, **waits)]) == {}
    assert "book-1" in looked([lost_sight_of(table, later, **{**waits, "looked_ns": SECOND_NS})])


def test_what_never_showed_may_be_carried_off_while_something_moves_around_its_place(table, lifted):
    scene, _ = lifted
    place = table.poses["book-1"]
    evidence = table.evidence(scene, "book-1", place)
    seen = observe(scene, evidence)
    task = lost_sight_of(table, scene, usual_nats=0.0)
    fit = fit_at(scene, task.model, evidence, place)

    def missed(track, *, shade=0.0, hand=0.0):
        live = seen.live + np.float32(shade)
        live[10:40, 10:40] += np.float32(hand)
        here = replace(task, track=track)
        return miss(here, weigh_measurement(here, replace(seen, live=live), fit))

    # The first picture cannot say whether something moves.
    begun = missed(task.track)
    assert begun.missing_ns == task.track.missing_ns == 0
    # A cloud before the sun is nobody.
    assert missed(begun, shade=0.1).missing_ns == FRAME_NS
    moved = missed(begun, hand=0.3)
    assert moved.missing_ns == 0
    # Who stands still does nothing.
    assert missed(moved, hand=0.3).missing_ns == FRAME_NS


def test_what_was_never_seen_waits_for_what_was(table, lifted):
    """However long ago that was looked for: else no turn is left in a room of hidden objects."""
    scene, _ = lifted
    later = replace(scene, frame=replace(scene.frame, t_ns=100 * SECOND_NS))
    last = {"known_ns": later.frame.t_ns - FRAME_NS, "looked_ns": later.frame.t_ns - FRAME_NS}
    book = lost_sight_of(table, later, **last)
    mug = table.task(
        later, "mug-1", state=TrackState.OCCLUDED, missed_frames=1, usual_nats=2.9, looked_ns=0
    )
    assert list(looked([mug, book])) == ["book-1"]
    assert list(looked([mug])) == ["mug-1"]


def test_what_a_look_is_due_or_pending_for_awaits_it(table, lifted):
    scene, _ = lifted
    due = lost_sight_of(table, scene)
    seen = table.task(scene, "mug-1")
    assert awaiting_look([due, seen], None) == {"book-1"}
    assert awaiting_look([seen], Search(due)) == {"book-1"}
    assert awaiting_look([seen], None) == frozenset()


def test_it_may_be_as_far_as_people_carry_things_and_at_any_height(table, lifted):
    scene, _ = lifted
    near = expected_of(lost_sight_of(table, scene))
    height_m = float(table.poses["book-1"].translation[2])
    assert near.stands(table.poses["book-1"])
    assert min(near.lifts_m) < height_m < max(near.lifts_m)
    later = replace(scene, frame=replace(scene.frame, t_ns=1_900_000_000))
    assert near.reach_m < expected_of(lost_sight_of(table, later)).reach_m == FARTHEST_M
    task = lost_sight_of(table, scene)
    wide = replace(task.model.source, box_m=(2 * WIDEST_CARRIED_M, 0.5, 0.8))
    assert expected_of(replace(task, model=replace(task.model, source=wide))).lifts_m == ()


@pytest.mark.parametrize(
    ("usual", "rate", "accounts"),
    [
        (1.6, MIN_RATE, True),
        (1.6, 0.5, False),
        (0.8, 0.45, True),
        (0.8, 0.3, False),
        (0.0, 0.5, False),
    ],
)
def test_a_pose_accounts_for_an_object_by_half_of_what_that_usually_shows(
    table, as_scanned, usual, rate, accounts
):
    track = table.task(as_scanned, "book-1", usual_rate=usual).track
    assert accounts_for(track, rate) is accounts


def next_picture(table, poses):
    """The frame after `lifted`."""
    return table.scene(poses, seq=2, t_ns=2 * FRAME_NS)


def test_what_a_longer_look_found_is_confirmed_where_it_ends(table, lifted):
    scene, then = lifted
    runner = Later()
    tracks, pending = look_around([lost_sight_of(table, scene)], None, runner=runner)
    assert tracks["book-1"].looked_ns == FRAME_NS
    assert tracks["book-1"].state is TrackState.OCCLUDED
    now = Pose(then.rotation, then.translation + np.array([0.06, 0.0, 0.0]))
    task = lost_sight_of(table, next_picture(table, {"book-1": now}), looked_ns=FRAME_NS)
    tracks, pending = look_around([task], pending, runner=runner)
    assert pending is None
    track = tracks["book-1"]
    assert track.state is TrackState.TRACKED
    assert track.known_ns == 2 * FRAME_NS
    assert np.linalg.norm(track.world_from_object.translation - now.translation) < 0.03


def test_a_camera_that_has_moved_since_ends_no_look(table, lifted):
    """With a headset on its pose is refined in most pictures: no look ever came to its end."""
    scene, then = lifted
    runner = Later()
    _, pending = look_around([lost_sight_of(table, scene)], None, runner=runner)
    later = next_picture(table, {"book-1": then})
    again = Pose(later.world_from_rig.rotation.copy(), later.world_from_rig.translation.copy())
    task = lost_sight_of(table, replace(later, world_from_rig=again), looked_ns=FRAME_NS)
    tracks, pending = look_around([task], pending, runner=runner)
    assert (pending, runner.given_up) == (None, [])
    assert tracks["book-1"].state is TrackState.TRACKED


def test_what_has_gone_on_by_the_end_of_a_look_is_not_where_it_was_found(table, lifted):
    scene, _ = lifted
    runner = Later()
    _, pending = look_around([lost_sight_of(table, scene)], None, runner=runner)
    gone = next_picture(table, {"book-1": Pose(np.eye(3), np.array([0.0, 0.0, -5.0]))})
    tracks, pending = look_around(
        [lost_sight_of(table, gone, looked_ns=FRAME_NS)], pending, runner=runner
    )
    assert pending is None
    assert tracks["book-1"].state is TrackState.OCCLUDED
    assert tracks["book-1"].world_from_object is table.poses["book-1"]


@pytest.mark.parametrize("is_hidden", [False, True])
def test_what_left_an_empty_place_may_show_less_than_all_elsewhere(table, monkeypatch, is_hidden):
    """Nobody stands before that place, whose clothes could be taken for a part of it."""
    before = table.poses["book-1"]
    now = Pose.from_yaw(before.yaw() + 0.6, before.translation + np.array([-0.25, 0.2, 0.15]))
    frame = table.filmed({"book-1": now}, seq=1, t_ns=FRAME_NS)
    if is_hidden:
        frame = replace(frame, images=(with_board(frame, before.translation),))
    scene = replace(table.scene(), frame=frame)
    monkeypatch.setattr("tracking.follow.rebirth.is_sure", lambda rate: False)
    track = looked([lost_sight_of(table, scene, world_from_stood=before)])["book-1"]
    apart_m = np.linalg.norm(track.world_from_object.translation - now.translation)
    assert (apart_m < 0.08) != is_hidden


@pytest.mark.parametrize(
    ("nats", "open_fraction", "unknown_fraction", "is_taken"),
    [
        # In a dark corner, and nobody is near.
        (12.0, 1.0, 0.02, True),
        # As much of somebody's clothes, or in his arms.
        (12.0, 1.0, 0.25, False),
        (26.0, 1.0, 0.25, True),
        # A sliver beside a curtain; a corner of it behind a sofa, in full.
        (20.0, 0.3, 0.05, False),
        (32.0, 0.3, 0.05, True),
    ],
)
def test_what_is_lost_is_found_where_enough_of_what_is_open_shows_it(
    table, lifted, monkeypatch, nats, open_fraction, unknown_fraction, is_taken
):
    scene, now = lifted
    task = lost_sight_of(table, scene, state=TrackState.LOST)
    evidence = gather(scene, task.model, view_of(scene, task.model, now), task.neighbours)
    fit = fit_at(scene, task.model, evidence, now)
    support = PoseSupport(nats, 30.0, open_fraction, 0.6, unknown_fraction, 900.0)
    found = [Hypothesis(fit, support)]
    monkeypatch.setattr("tracking.follow.rebirth.born", lambda *args, **more: found)
    assert (looked([task])["book-1"].state is TrackState.TRACKED) == is_taken


def with_board(frame, place):
    """The picture of a frame with a grey board before a place."""
    image, lens = frame.images[0].copy(), frame.rig.lenses[0]
    (pixel,), _ = lens.project((frame.world_from_rig.inverse() @ place)[None])
    column, row = np.round(pixel).astype(int)
    image[row - 50 : row + 50, column - 50 : column + 50] = (90, 90, 95)
    return image


def test_a_look_that_is_not_needed_any_more_is_given_up(table, lifted):
    scene, then = lifted
    runner = Later()
    _, pending = look_around([lost_sight_of(table, scene)], None, runner=runner)
    found = {"state": TrackState.TRACKED, "world_from_object": then, "rate": 1.2}
    later = next_picture(table, {"book-1": then})
    task = lost_sight_of(table, later, sure_ns=2 * FRAME_NS, **found)
    assert look_around([task], pending, runner=runner) == ({}, None)
    assert runner.given_up == [7]


def test_a_look_beside_the_frames_comes_to_the_same_pose_to_the_bit(table, lifted):
    scene, _ = lifted
    task = lost_sight_of(table, scene)
    here = looked([task])["book-1"]
    runner, pending, until = SearchBesideFrames(), None, time.monotonic() + 120.0
    try:
        tracks, pending = look_around([task], pending, runner=runner)
        while pending is not None and time.monotonic() < until:
            time.sleep(0.02)
            tracks, pending = look_around([task], pending, runner=runner)
    finally:
        runner.close()
    there = tracks["book-1"]
    np.testing.assert_array_equal(there.world_from_object.matrix(), here.world_from_object.matrix())
    np.testing.assert_array_equal(there.covariance, here.covariance)
