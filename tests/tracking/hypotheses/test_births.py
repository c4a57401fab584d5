"""Objects that were just taken from their place are found around it, in one picture."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.births import CLIMB_STEPS, Expected, born, climb, starts_in, surroundings
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


def test_poses_that_climb_together_get_where_each_gets_alone(table, mug_elsewhere):
    scene, _ = mug_elsewhere
    model, where = table.models["mug-1"], expected(table, "mug-1")
    around = surroundings(scene, model, neighbours=table.neighbours("mug-1"), expected=where)
    standing = starts_in(around)[:4]
    lifted = [Pose.from_yaw(1.0, pose.translation + np.array([0, 0, 0.07])) for pose in standing]
    poses = [*standing, *lifted]
    starts = list(zip(around.log_odds(poses), poses, strict=True))
    together = climb(around, starts, step=CLIMB_STEPS[0])
    for start, (odds, pose) in zip(starts, together, strict=True):
        ((odds_alone, pose_alone),) = climb(around, [start], step=CLIMB_STEPS[0])
        assert odds == odds_alone >= start[0]
        assert np.array_equal(pose.matrix(), pose_alone.matrix())
        assert odds == pytest.approx(around.log_odds([pose])[0], rel=1e-12)
    assert any(odds > start[0] for start, (odds, _) in zip(starts, together, strict=True))
