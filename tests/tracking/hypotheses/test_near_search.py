"""Objects that were just taken from their place are found around it, in one picture."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.hypothesis import CLEAR_NATS, apart
from tracking.hypotheses.near_search import Nearby, search_near

HEIGHTS_M = (0.0, 0.74, 0.89)


def nearby(table, name, **changed):
    return replace(Nearby(table.poses[name], 0.45, HEIGHTS_M), **changed)


def test_a_book_that_was_lifted_and_turned_is_found(table):
    before = table.poses["book-1"]
    lifted = Pose.from_yaw(before.yaw() + 0.3, before.translation + np.array([-0.15, 0.1, 0.15]))
    scene, model = table.scene({"book-1": lifted}), table.models["book-1"]
    found = search_near(scene, model, table.neighbours("book-1"), nearby(table, "book-1"))
    assert found[0].log_odds > CLEAR_NATS
    assert apart(found[0].world_from_object, lifted) < 0.05


def test_what_was_put_elsewhere_is_found(table, mug_elsewhere):
    scene, now = mug_elsewhere
    found = search_near(
        scene, table.models["mug-1"], table.neighbours("mug-1"), nearby(table, "mug-1")
    )
    assert apart(found[0].world_from_object, now) < 0.02
    assert found[0].log_odds > CLEAR_NATS


def test_what_is_not_there_is_not_found(table, no_mug):
    found = search_near(
        no_mug, table.models["mug-1"], table.neighbours("mug-1"), nearby(table, "mug-1")
    )
    assert not any(item.log_odds > CLEAR_NATS for item in found)


def test_one_pose_shares_the_odds_with_all_places_in_reach(table):
    model = table.models["mug-1"]
    near, far = (nearby(table, "mug-1", reach_m=reach_m) for reach_m in (0.2, 0.4))
    assert near.log_prior(model) - far.log_prior(model) == pytest.approx(np.log(4.0))
