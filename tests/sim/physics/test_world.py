"""Contact decides: what is pushed slides upright, walls hold, a released book lies flat."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.people.actors import TICK_NS, Actor
from sim.physics.moving.people import HAND_RADIUS_M, HandTarget, PersonTarget
from sim.physics.world import World
from sim.scenarios.actions import Carry, Hide, Push, Stand, Turn, Walk

SECOND_NS = 1_000_000_000
TABLE_TOP_M = 0.72
CAMERA_XY = np.array([0.0, -0.5])


def _tilt_deg(pose):
    return math.degrees(math.acos(min(1.0, pose.rotation[2, 2])))


def _play(room, actions, start=(-1.5, -1.5), seconds=14.0):
    """Run a script; returns the world, the largest tilt per object and what was said."""
    actor = Actor("ann", room, start=start, yaw=0.0, actions=actions, camera_xy=CAMERA_XY)
    world = World(room, {"ann": actor.target()})
    tilt = dict.fromkeys(world.object_poses(), 0.0)
    said = []
    for _ in range(round(seconds * SECOND_NS / TICK_NS)):
        text = actor.tick(world)
        if text is not None:
            said.append(text)
        world.move_people({"ann": actor.target()})
        world.step(TICK_NS)
        for name, pose in world.object_poses().items():
            tilt[name] = max(tilt[name], _tilt_deg(pose))
    return world, tilt, said, actor


def _person(left, right):
    return PersonTarget(np.array([-1.8, -1.8]), left, right)


def test_nothing_moves_by_itself(small_room):
    aside = HandTarget(np.array([-1.8, -1.8, 1.0]))
    world = World(small_room, {"ann": _person(aside, aside)})
    before = world.object_poses()
    world.step(3 * SECOND_NS)
    assert world.t_ns == 3 * SECOND_NS
    for name, pose in world.object_poses().items():
        assert np.abs(pose.translation - before[name].translation).max() < 3e-4
        assert _tilt_deg(pose) < 0.05


@pytest.mark.parametrize("goal", [(-0.7, -0.2), (0.4, 0.9), (-1.4, 1.1), (-0.1, 0.3)])
def test_a_pushed_chair_slides_upright_to_about_where_it_should(small_room, goal):
    world, tilt, said, _ = _play(small_room, [Push("chair-1", goal)])
    start = small_room.object_by_id("chair-1").world_from_object.translation
    pose = world.object_pose("chair-1")
    assert said == ["pushes chair-1", "lets go of chair-1"]
    assert np.linalg.norm(pose.translation - start) > 0.5
    assert np.linalg.norm(pose.translation[:2] - goal) < 0.25
    assert tilt["chair-1"] < 6.0
    assert _tilt_deg(pose) < 0.1
    assert abs(pose.translation[2]) < 1e-3


def test_a_chair_is_turned_by_two_hands(small_room):
    world, tilt, _, _ = _play(small_room, [Turn("chair-1", 50.0)], seconds=9.0)
    before = small_room.object_by_id("chair-1").world_from_object
    turned = math.degrees(world.object_pose("chair-1").yaw() - before.yaw())
    assert 20.0 < turned < 65.0
    assert tilt["chair-1"] < 6.0


def test_a_hand_stops_at_a_wall(small_room):
    world = World(small_room, {"ann": _person(*[HandTarget(np.array([-1.5, 0.0, 1.0]))] * 2)})
    for k in range(200):
        wanted = HandTarget(np.array([-1.5 - 0.01 * k, 0.0, 1.0]), solid=True)
        world.move_people({"ann": _person(wanted, wanted)})
        world.step(10_000_000)
    assert world.hand_position("ann", "left")[0] > -2.0 + HAND_RADIUS_M - 0.01


def test_a_chair_is_not_pushed_through_a_wall(small_room):
    world, tilt, _, _ = _play(small_room, [Push("chair-1", (-1.94, 1.0))])
    pose = world.object_pose("chair-1")
    corners = pose @ np.array([[x, y, 0.4] for x in (-0.21, 0.21) for y in (-0.21, 0.21)])
    assert corners[:, 0].min() > -2.01
    assert corners[:, 0].min() < -1.9
    assert tilt["chair-1"] < 15.0


def test_a_carried_book_lies_flat_where_it_was_put(small_room):
    world, _, said, _ = _play(small_room, [Carry("book-1", (1.35, 0.95), turn_deg=40.0)])
    before = small_room.object_by_id("book-1").world_from_object
    pose = world.object_pose("book-1")
    assert said == ["takes book-1", "puts down book-1"]
    assert np.linalg.norm(pose.translation[:2] - (1.35, 0.95)) < 0.01
    assert math.degrees(pose.yaw() - before.yaw()) == pytest.approx(40.0, abs=2.0)
    assert _tilt_deg(pose) < 0.2
    assert abs(pose.translation[2] - TABLE_TOP_M) < 1e-3


def test_a_dropped_book_sinks_less_than_five_millimetres(small_room):
    over = np.array([1.35, 0.6, TABLE_TOP_M + 0.05])
    away = HandTarget(np.array([1.35, 0.6, 1.4]))
    world = World(small_room, {"ann": _person(away, HandTarget(over))})
    held = HandTarget(over, holds="book-1")
    world.move_people({"ann": _person(away, held)})
    lifted = HandTarget(over + np.array([0.0, 0.0, 0.3]), holds="book-1")
    world.move_people({"ann": _person(away, lifted)})
    world.step(SECOND_NS)
    assert world.object_pose("book-1").translation[2] > TABLE_TOP_M + 0.25
    world.move_people({"ann": _person(away, HandTarget(over + np.array([0.0, 0.0, 0.3])))})
    lowest = np.inf
    for _ in range(100):
        world.step(10_000_000)
        lowest = min(lowest, world.object_pose("book-1").translation[2])
    assert lowest > TABLE_TOP_M - 0.005
    assert _tilt_deg(world.object_pose("book-1")) < 0.2


def test_people_walk_around_furniture_and_stand_in_the_way(small_room):
    actions = [Walk((1.3, -1.5)), Hide("chair-1", 0.5), Stand(0.5)]
    world, _, said, actor = _play(small_room, actions, start=(1.3, 1.6), seconds=12.0)
    for name, pose in world.object_poses().items():
        before = small_room.object_by_id(name).world_from_object
        assert np.abs(pose.translation - before.translation).max() < 1e-3
    assert said == ["hides chair-1"]
    chair = world.object_pose("chair-1").translation[:2]
    to_chair = (chair - CAMERA_XY) / np.linalg.norm(chair - CAMERA_XY)
    off_line = actor.target().position - CAMERA_XY
    assert np.linalg.norm(off_line - (off_line @ to_chair) * to_chair) < 0.05
    assert 0.3 < off_line @ to_chair < 1.2


def test_support_is_the_surface_below(small_room):
    aside = HandTarget(np.array([-1.8, -1.8, 1.0]))
    world = World(small_room, {"ann": _person(aside, aside)})
    assert world.support_height(np.array([1.4, 0.7, 0.9])) == pytest.approx(TABLE_TOP_M)
    assert world.support_height(np.array([1.4, 0.7, 0.3])) == 0.0
    assert world.support_height(np.array([0.0, 0.0, 1.0])) == 0.0
