"""Goals: layouts in place, figures wherever they lie, twins that stand for each other."""

import math

import numpy as np
import pytest

from scenes.pose import Pose
from studio.study.goals import GoalWatch, judged, moved_onto, yaw_apart
from studio.study.plan import FIRST_STUDY, Goal, GoalKind, Target, read_study

FISH = read_study(FIRST_STUDY).task("tangram").goal
TOP = 0.74


def laid(goal, *, moved=(0.0, 0.0), turn=0.0):
    cos, sin = math.cos(turn), math.sin(turn)
    poses = {}
    for target in goal.targets:
        x, y = target.place_m
        place = (cos * x - sin * y + moved[0], sin * x + cos * y + moved[1], TOP)
        poses[target.object_id] = Pose.from_yaw(target.yaw_rad + turn, place)
    return poses


@pytest.mark.parametrize("turn_deg", [0, 33, 90, -170])
def test_a_figure_is_met_wherever_it_lies(turn_deg):
    reached = judged(FISH, laid(FISH, moved=(0.1, -0.05), turn=math.radians(turn_deg)))
    assert reached.is_met
    assert max(reached.off_m.values()) < 1e-9


def test_pieces_of_one_kind_stand_for_each_other_and_symmetric_ones_turn():
    poses = laid(FISH)
    poses["large-1"], poses["large-2"] = poses["large-2"], poses["large-1"]
    square, slanted = poses["square-1"], poses["parallelogram-1"]
    poses["square-1"] = Pose.from_yaw(square.yaw() + math.pi / 2, square.translation)
    poses["parallelogram-1"] = Pose.from_yaw(slanted.yaw() + math.pi, slanted.translation)
    assert judged(FISH, poses).is_met
    poses["parallelogram-1"] = Pose.from_yaw(slanted.yaw() + math.pi / 2, slanted.translation)
    assert judged(FISH, poses).there == 6


def test_a_mirrored_figure_is_another():
    poses = {
        name: Pose.from_yaw(-pose.yaw(), pose.translation * [1, -1, 1])
        for name, pose in laid(FISH).items()
    }
    assert not judged(FISH, poses).is_met


def test_a_layout_is_met_in_its_place_alone():
    goal = Goal(
        GoalKind.LAYOUT,
        (Target("a", (0.0, 0.0), 0.0, kind="chair"), Target("b", (1.0, 0.0), 0.0, kind="chair")),
    )
    assert judged(goal, laid(goal)).is_met
    assert not judged(goal, laid(goal, moved=(0.06, 0.0))).is_met
    assert judged(goal, laid(goal, moved=(0.04, 0.0))).is_met
    swapped = laid(goal)
    swapped["a"], swapped["b"] = swapped["b"], swapped["a"]
    assert judged(goal, swapped).is_met
    assert judged(goal, {"a": swapped["a"]}) is None  # one is unknown
    assert judged(Goal(), swapped) is None


def test_a_goal_is_reached_once_it_was_held():
    goal = Goal(GoalKind.LAYOUT, (Target("a", (0.0, 0.0), 0.0),), hold_s=1.0)
    watch, there, away = GoalWatch(goal), laid(goal), laid(goal, moved=(0.3, 0.0))
    assert not watch.look(there, 0)
    assert not watch.look(away, 500_000_000)
    assert not watch.look(there, 600_000_000)
    assert watch.look(there, 1_600_000_000)
    assert watch.reached_ns == 600_000_000
    assert watch.look(away, 2_000_000_000)  # it stays so


def test_yaws_that_look_the_same_are():
    assert yaw_apart(math.radians(100), 4) == pytest.approx(math.radians(10))
    assert yaw_apart(3.0, 0) == 0.0
    places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]])
    moved, turn = moved_onto(places @ np.array([[0, 1], [-1, 0]]) + 3.0, places)
    assert np.allclose(moved, places)
    assert turn == pytest.approx(-math.pi / 2)
