"""Objects that were just taken from their place are found around it, in one picture."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses import births
from tracking.hypotheses.births import STEP, Expected, born, set_down, starts_in, surroundings
from tracking.hypotheses.hypothesis import CLEAR_NATS, apart

SUPPORTS_M = (0.0, 0.74, 0.89)


def expected(table, name, **changed):
    before = table.poses[name]
    height_m = float(before.translation[2])
    lifts = tuple(height_m + lift for lift in (0.0, 0.15, 0.3))
    return replace(Expected((before,), 0.44, SUPPORTS_M, lifts), **changed)


def around_its_place(table, scene, name):
    """Poses found of an object around where it was."""
    neighbours, where = table.neighbours(name), expected(table, name)
    return born(scene, table.models[name], neighbours=neighbours, expected=where)


@pytest.mark.parametrize("reach_m", [0.44, 0.6])
def test_a_book_that_was_lifted_and_turned_is_found(table, reach_m):
    before = table.poses["book-1"]
    lifted = Pose.from_yaw(before.yaw() + 0.3, before.translation + np.array([-0.15, 0.1, 0.15]))
    scene, model = table.scene({"book-1": lifted}), table.models["book-1"]
    where = expected(table, "book-1", reach_m=reach_m)
    found = born(scene, model, neighbours=table.neighbours("book-1"), expected=where)
    assert found[0].log_odds > CLEAR_NATS
    assert apart(found[0].world_from_object, lifted) < 0.05


def test_what_was_put_elsewhere_is_found(table, mug_elsewhere):
    scene, now = mug_elsewhere
    found = around_its_place(table, scene, "mug-1")
    assert apart(found[0].world_from_object, now) < 0.02
    assert found[0].log_odds > CLEAR_NATS


def test_what_is_not_there_is_not_found(table, no_mug):
    found = around_its_place(table, no_mug, "mug-1")
    assert not any(item.log_odds > CLEAR_NATS for item in found)


def test_one_pose_shares_the_odds_with_all_places_in_reach(table):
    model, pose = table.models["mug-1"], table.poses["mug-1"]
    near, far = (expected(table, "mug-1", reach_m=reach_m) for reach_m in (0.2, 0.4))
    assert near.log_prior(model, pose) - far.log_prior(model, pose) == pytest.approx(np.log(4.0))


def test_to_be_in_the_air_takes_clear_odds(table):
    model, pose = table.models["mug-1"], table.poses["mug-1"]
    where = expected(table, "mug-1")
    lifted = Pose(pose.rotation, pose.translation + np.array([0.0, 0.0, 0.07]))
    standing, carried = (where.log_prior(model, at) for at in (pose, lifted))
    assert standing - carried == pytest.approx(CLEAR_NATS)


def test_what_stands_is_not_lifted_by_a_climb(table, mug_elsewhere):
    around = around_the_mug(table, mug_elsewhere[0])
    standing = table.poses["mug-1"]
    lifted = Pose(standing.rotation, standing.translation + np.array([0.0, 0.0, 0.07]))
    up = [around.cloud(pose, spread=0.25).spread[2, 2] for pose in (standing, lifted)]
    assert up == [0.0, pytest.approx(0.25 * table.models["mug-1"].radius_m)]


def test_a_pose_above_a_plane_is_tried_where_it_would_stand_farther_along_the_sight(
    table, mug_elsewhere
):
    around = around_the_mug(table, mug_elsewhere[0])
    standing = table.poses["mug-1"]
    eye = around.look.world_from_lens.translation
    nearer = standing.translation + 0.1 * (eye - standing.translation)
    lifted = Pose(standing.rotation, nearer)
    assert any(apart(pose, standing) < 1e-9 for pose in set_down(around, lifted))
    assert set_down(around, standing) == []


def test_a_passer_by_leaves_places_beside_him(table, mug_elsewhere, monkeypatch):
    """All of the most changed places were in a person's silhouette, and a book beside it missed."""
    scene, now = mug_elsewhere
    height_m = float(now.translation[2])
    lifts = tuple(height_m + 0.15 * step for step in range(1, 6))
    where = expected(table, "mug-1", supports_m=(height_m,), lifts_m=lifts)
    around = replace(around_the_mug(table, scene), expected=where)
    look = around.look
    at, _ = look.camera.project((look.world_from_lens.inverse() @ now.translation)[None])
    x, y = at[0].round().astype(int)
    picture = look.picture.copy()
    picture[..., 4] = 0.0
    picture[:, x - 70 : x - 40, 4] = 1.0
    picture[y - 14 : y + 6, x - 8 : x + 8, 4] = 0.8
    monkeypatch.setattr(births, "MAX_PLACES", 200)
    places = starts_in(replace(around, look=replace(look, picture=picture)))
    assert min(apart(place, now) for place in places) < STEP * around.model.radius_m


def around_the_mug(table, scene):
    where = expected(table, "mug-1")
    neighbours = table.neighbours("mug-1")
    return surroundings(scene, table.models["mug-1"], neighbours=neighbours, expected=where)
