"""Lost things are looked for over the whole room."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.budget import NotYet, Pace
from tracking.hypotheses.hypothesis import Hypothesis
from tracking.hypotheses.positions import overview
from tracking.hypotheses.room_search import (
    UNAMBIGUOUS_CONTOUR_SCORE,
    UNAMBIGUOUS_VISIBLE,
    candidates,
    is_unambiguous,
    ranked,
    turned,
)


def searched(table, scene, name, *, support_heights_m=None, pace=None):
    return candidates(
        scene,
        overview(scene),
        table.models[name],
        table.neighbours(name),
        support_heights_m=scene.support_planes.heights_m
        if support_heights_m is None
        else support_heights_m,
        last=table.poses[name].translation,
        enough=1,
        pace=pace or Pace(),
    )


def test_the_best_candidate_is_where_the_thing_was_put(table, mug_elsewhere):
    scene, now = mug_elsewhere
    best, *others = searched(table, scene, "mug-1")
    assert np.linalg.norm(best.world_from_object.translation - now.translation) < 0.01
    assert all(best.score >= other.score for other in others)
    assert all(scene.contains(hypothesis.world_from_object) for hypothesis in [best, *others])


def test_nothing_is_looked_for_off_the_heights_it_may_stand_on(table, mug_elsewhere):
    scene, _now = mug_elsewhere
    found = searched(table, scene, "mug-1", support_heights_m=(0.0,))
    assert all(abs(hypothesis.world_from_object.translation[2]) < 0.02 for hypothesis in found)
    assert all(hypothesis.score < 0.3 for hypothesis in found)


def test_a_search_takes_no_more_time_than_it_is_given(table, mug_elsewhere):
    with pytest.raises(NotYet):
        searched(table, mug_elsewhere[0], "mug-1", pace=Pace(1.0))


def test_the_yaws_to_try_about_a_place_hold_what_is_believed_of_a_small_thing(table, mug_elsewhere):
    scene, now = mug_elsewhere
    mug = table.models["mug-1"]
    starts = turned(mug, table.evidence(scene, "mug-1", now), now)
    assert starts[0] is now
    assert 1 < len(starts) <= 5
    spread = 0.6 * mug.radius_m
    assert all(np.linalg.norm(s.translation - now.translation) < spread for s in starts)


@pytest.mark.parametrize(
    ("support", "visible", "textured", "sure"),
    [
        (UNAMBIGUOUS_CONTOUR_SCORE, UNAMBIGUOUS_VISIBLE, False, True),
        (UNAMBIGUOUS_CONTOUR_SCORE - 0.01, 1.0, False, False),
        (1.0, UNAMBIGUOUS_VISIBLE - 0.01, False, False),
        (1.0, 1.0, True, False),
    ],
)
def test_only_a_plain_thing_s_whole_outline_leaves_no_doubt(support, visible, textured, sure):
    fit = SimpleNamespace(contour_score=support, visible_fraction=visible, textured=textured)
    assert is_unambiguous(fit) == sure


def test_guesses_are_ranked_each_once_and_only_inside_the_room(table, as_scanned):
    def hypothesis(pose, share):
        return Hypothesis(SimpleNamespace(world_from_object=pose), share)

    here = table.poses["mug-1"]
    outside = Pose.from_yaw(0.0, (9.0, 0.0, 0.0))
    twice = Pose.from_yaw(here.yaw() + 0.01, here.translation)
    said = [hypothesis(here, 0.4), hypothesis(outside, 0.9), hypothesis(twice, 0.5)]
    assert ranked(as_scanned, table.models["mug-1"], said) == [said[2]]
