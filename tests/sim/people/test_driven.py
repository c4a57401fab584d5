"""A person driven by a headset pushes, grabs, carries and throws in a scanned room."""

import math

import numpy as np
import pytest

from benchmarks.twin.scan_like import block
from devices.messages import PoseSample
from scenes.frames import look_at
from scenes.mesh import BoxPart, PhysicalObject
from scenes.pose import Pose
from sim.people.driven import DrivenPerson, GripSample
from sim.physics.collision.surface import surface_of
from sim.physics.scanned.twin import Twin

TICK_NS = 10_000_000
ROOM = block((0, 0, 0), (4, 3, 2.5), is_room=True)
SIZES = {"box": (0.3, 0.3, 0.3)}


def box(place):
    part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, 0.15)), (0.15, 0.15, 0.15))
    return PhysicalObject(
        "box", "box", (), SIZES["box"], (part,), 1.5, 0.4, Pose.from_yaw(0.0, place)
    )


def sample(body, k, place, yaw=0.0, at_ns=None):
    pose = Pose.from_yaw(yaw, place)
    if body == "head":
        pose = look_at(np.array(place), np.add(place, (math.cos(yaw), math.sin(yaw), 0)))
    return PoseSample("headset", body, k, k * TICK_NS if at_ns is None else at_ns, pose)


@pytest.fixture
def scene():
    person = DrivenPerson("eve", start=(0.6, 1.5), yaw=0.0)
    twin = Twin(surface_of(ROOM), (box((1.6, 1.5, 0.0)),), people={"eve": person.target()})
    return person, twin


def play(person, twin, hand_path, *, closed=lambda k: False):
    """Feed a recorded path of the right hand, tick by tick; the other hand is held aside."""
    for k, place in enumerate(hand_path):
        person.see(sample("head", k, (place[0] - 0.5, 1.5, 1.6)))
        person.see(sample("right", k, place))
        person.grip(GripSample("right", k * TICK_NS, closed(k)))
        person.tick(twin, SIZES)
        twin.move_people({"eve": person.target()})
        twin.step(TICK_NS)


def along(start, end, count):
    return [np.array(start) + (np.array(end) - start) * k / count for k in range(count + 1)]


def test_a_hand_pushes_a_box_along(scene):
    person, twin = scene
    play(person, twin, along((1.2, 1.5, 0.15), (2.4, 1.5, 0.15), 200))
    x, y, z = twin.object_pose("box").translation
    # The box is ahead of the hand: half a box and the hand's own radius.
    assert x == pytest.approx(2.4 + 0.15 + 0.045, abs=0.06)
    assert (y, z) == pytest.approx((1.5, 0.0), abs=0.02)


def test_a_closed_hand_carries_and_an_open_one_throws(scene):
    person, twin = scene
    above = along((1.6, 1.5, 0.5), (1.6, 1.5, 0.36), 30)
    up = along((1.6, 1.5, 0.36), (1.2, 1.5, 1.3), 150)
    swing = along((1.2, 1.5, 1.3), (2.0, 1.5, 1.3), 40)
    path = [*above, *up, *swing]
    play(person, twin, path, closed=lambda k: k > 25)
    assert twin.object_pose("box").translation[2] == pytest.approx(1.0, abs=0.1)
    hand_before = twin.hand_position("eve", "right")
    k = len(path)
    person.see(sample("right", k, (2.02, 1.5, 1.3)))
    person.grip(GripSample("right", k * TICK_NS, False))
    person.tick(twin, SIZES)
    twin.move_people({"eve": person.target()})
    twin.step(TICK_NS)
    hand_speed = (twin.hand_position("eve", "right") - hand_before)[0] / 0.01
    assert twin.speed("box") == pytest.approx(hand_speed, rel=0.25)
    assert twin.speed("box") > 1.2
    twin.step(1_500_000_000)
    x, _, z = twin.object_pose("box").translation
    # It flies half a second, at about the hand's speed.
    assert x > 2.0 + 0.4
    assert z < 0.3


def test_late_samples_undo_nothing_and_missing_ones_hold(scene):
    person, twin = scene
    assert person.see(sample("right", 5, (1.0, 1.2, 1.0)))
    assert not person.see(sample("right", 6, (9.0, 9.0, 9.0), at_ns=3 * TICK_NS))
    for _ in range(50):
        person.tick(twin, SIZES)
        twin.move_people({"eve": person.target()})
        twin.step(TICK_NS)
    assert twin.hand_position("eve", "right") == pytest.approx([1.0, 1.2, 1.0], abs=0.01)
    assert person.target().left.solid is False


def test_the_body_follows_the_head(scene):
    person, twin = scene
    person.see(sample("head", 1, (1.0, 2.0, 1.62), yaw=0.5 * math.pi))
    assert person.target().position == pytest.approx([1.0, 1.92])
    posture = person.posture(twin)
    assert posture.yaw == pytest.approx(0.5 * math.pi)
    assert posture.crouch_m == pytest.approx(0.0)
    person.see(sample("head", 2, (1.0, 2.0, 1.2), yaw=0.5 * math.pi))
    assert person.posture(twin).crouch_m == pytest.approx(0.42)


def test_a_hand_turned_past_half_a_turn_goes_on(scene):
    person, _ = scene
    for k in range(40):
        person.see(sample("right", k, (1.0, 1.2, 1.0), yaw=math.radians(10.0 * k)))
    assert person.target().right.yaw == pytest.approx(math.radians(390.0))


def test_what_is_no_head_or_hand_is_refused(scene):
    person, _ = scene
    with pytest.raises(ValueError, match="'knee', wanted head, left, right"):
        person.see(sample("knee", 1, (0.0, 0.0, 0.0)))
    with pytest.raises(ValueError, match="'foot'"):
        person.grip(GripSample("foot", 0, True))
