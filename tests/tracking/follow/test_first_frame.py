"""A first frame settles all objects together: what does not hold is searched for again."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.follow.first_frame import settle_all
from tracking.follow.track import new_track
from tracking.hypotheses.prior import stayed_log_prior


@pytest.fixture
def believed(table):
    """Tracks that have every object where it was scanned."""

    def make(**changed):
        return {
            name: replace(new_track(model), confidence=1.0, **changed.get(name.split("-")[0], {}))
            for name, model in table.models.items()
        }

    return make


def tasks(table, scene):
    return [table.task(scene, name) for name in table.models]


def apart_m(track, pose):
    return float(np.linalg.norm(track.world_from_object.translation - pose.translation))


def test_what_stands_as_scanned_stays_there(table, as_scanned, believed):
    tracks = settle_all(tasks(table, as_scanned), believed())
    for name, pose in table.poses.items():
        assert tracks[name].state is TrackState.STATIC
        assert apart_m(tracks[name], pose) == 0.0
        assert tracks[name].confidence > 0.9


def test_a_place_that_the_picture_speaks_against_is_given_up(table, mug_elsewhere, believed):
    scene, now = mug_elsewhere
    tracks = settle_all(tasks(table, scene), believed())
    assert apart_m(tracks["mug-1"], now) < 0.01
    assert apart_m(tracks["book-1"], table.poses["book-1"]) == 0.0


def test_two_that_account_for_one_part_of_the_picture_do_not_both_hold(table, as_scanned, believed):
    """A second book taken to lie a little in front of the first, in its place in the picture."""
    scan = table.poses["book-1"]
    beside = Pose.from_yaw(scan.yaw(), scan.translation + np.array([0.0, 0.02, 0.0]))
    twin = table.task(as_scanned, "book-1")
    twin = replace(
        twin, model=replace(twin.model, source=replace(twin.model.source, object_id="book-2"))
    )
    both = {
        **believed(book={"usual_nats": 30.0}),
        "book-2": replace(new_track(twin.model), world_from_object=beside, confidence=1.0),
    }
    tracks = settle_all([*tasks(table, as_scanned), twin], both)
    assert apart_m(tracks["book-1"], scan) == 0.0
    assert tracks["book-2"].state is TrackState.LOST


def test_what_is_nowhere_is_lost(table, no_mug, believed):
    tracks = settle_all(tasks(table, no_mug), believed())
    assert tracks["mug-1"].state is TrackState.LOST
    assert tracks["mug-1"].confidence == 0.0


def test_what_hides_is_doubted_where_others_have_left(table, as_scanned, no_mug, believed):
    """How much was moved differs from session to session, and the others tell."""
    seen = {"usual_nats": 30.0}

    def stays_nats(scene, **changed):
        tracks = believed(**changed)
        return settle_all(tasks(table, scene), tracks)["mug-1"].stays_nats

    nothing_known = new_track(table.models["mug-1"]).stays_nats
    assert stays_nats(as_scanned, book=seen, box=seen) > nothing_known + 1.0
    lost = {"state": TrackState.LOST}
    assert stays_nats(no_mug, mug=lost, book=seen, box=seen) > nothing_known + 1.0
    assert stayed_log_prior(left=5) < stayed_log_prior(stayed=5, left=5) < nothing_known
