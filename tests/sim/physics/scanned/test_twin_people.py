"""People in a scanned room: hands wake what they touch, and edits leave everybody as they were."""

import numpy as np
import pytest

from benchmarks.twin.scan_like import block
from scenes.mesh import BoxPart, PhysicalObject
from scenes.pose import Pose
from sim.physics.collision.heights import height_below
from sim.physics.collision.orientation import turn_to_free_side
from sim.physics.collision.surface import surface_of
from sim.physics.moving.people import HandTarget, People, PersonTarget
from sim.physics.moving.primitives import Primitive, Shape
from sim.physics.scanned.twin import Twin

SECOND_NS = 1_000_000_000
TICK_NS = 10_000_000
ROOM = block((0, 0, 0), (4, 3, 2.5), is_room=True)
AWAY = HandTarget(np.array([0.3, 0.3, 1.0]))


def box(place):
    part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, 0.2)), (0.2, 0.2, 0.2))
    return PhysicalObject(
        "box", "box", (), (0.4, 0.4, 0.4), (part,), 2.0, 0.4, Pose.from_yaw(0.0, place)
    )


def person(right, *, at=(0.5, 1.5), solid=True):
    return {"ann": PersonTarget(np.array(at), AWAY, right, solid)}


def hand(x, z=0.2, *, holds=None):
    return HandTarget(np.array([x, 1.5, z]), solid=holds is None, holds=holds)


@pytest.fixture
def twin():
    twin = Twin(surface_of(ROOM), (box((1.6, 1.5, 0.0)),), people=person(hand(1.0)))
    twin.step(3 * SECOND_NS)
    return twin


def test_a_hand_wakes_and_pushes_what_sleeps(twin):
    for k in range(60):
        twin.move_people(person(hand(1.0 + 0.01 * k)))
        twin.step(TICK_NS)
    assert twin.object_pose("box").translation[0] == pytest.approx(1.59 + 0.245, abs=0.03)


def test_a_torso_pushes_what_is_tall_unless_its_person_sits(twin):
    tall = Primitive("post", Shape.CYLINDER, (0.2, 0.2, 1.6), Pose.from_yaw(0.0, (2.5, 2.2, 0.8)))
    twin.add_virtual(tall)
    twin.step(3 * SECOND_NS)
    for solid in (False, True):
        for k in range(60):
            twin.move_people(person(hand(0.3, 1.0), at=(1.9 + 0.01 * k, 2.2), solid=solid))
            twin.step(TICK_NS)
        moved = np.linalg.norm(twin.object_pose("post").translation - (2.5, 2.2, 0.8))
        assert (moved > 0.05) == solid


def test_what_is_held_stays_in_the_hand_while_the_room_is_compiled_anew(twin):
    twin.move_people(person(hand(1.6, 0.42, holds="box")))
    twin.step(SECOND_NS // 2)
    for k in range(80):
        twin.move_people(person(hand(1.6, 0.42 + 0.01 * k, holds="box")))
        twin.step(TICK_NS)
    before, where = twin.object_pose("box"), twin.hand_position("ann", "right")
    assert before.translation[2] > 0.6
    ball = Primitive("ball", Shape.SPHERE, (0.2,) * 3, Pose.from_yaw(0.0, (3.0, 0.5, 0.1)))
    twin.add_virtual(ball)
    # It moves at 1 m/s, and places of bodies are those before the last step.
    assert twin.hand_position("ann", "right") == pytest.approx(where, abs=3e-3)
    twin.step(SECOND_NS)
    moved = twin.object_pose("box").translation - before.translation
    assert np.abs(moved).max() < 0.05
    assert twin.object_pose("box").translation[2] > 0.6
    # The hand is inside the box; a solid one would carry it still.
    twin.move_people(person(HandTarget(np.array([1.6, 1.5, 1.3]))))
    twin.step(SECOND_NS)
    assert twin.object_pose("box").translation[2] == pytest.approx(0.0, abs=0.01)


def test_a_hand_takes_a_virtual_ball_too(twin):
    ball = Primitive("ball", Shape.SPHERE, (0.2,) * 3, Pose.from_yaw(0.0, (3.0, 1.5, 0.1)))
    twin.add_virtual(ball)
    twin.move_people(person(hand(2.95, 0.25)))
    twin.step(SECOND_NS)
    twin.move_people(person(hand(2.95, 0.25, holds="ball")))
    twin.step(TICK_NS)
    for k in range(60):
        twin.move_people(person(hand(2.95, 0.25 + 0.01 * k, holds="ball")))
        twin.step(TICK_NS)
    assert twin.object_pose("ball").translation[2] > 0.5


def test_an_edit_leaves_hands_alone(twin):
    twin.rescan(
        np.array([[2.5, 2.5, -0.1], [3.5, 2.9, 0.5]]), block((2.6, 2.6, 0), (3.2, 2.8, 0.4))
    )
    twin.move_people(person(hand(1.2)))
    twin.step(SECOND_NS)
    assert twin.hand_position("ann", "right") == pytest.approx((1.2, 1.5, 0.2), abs=0.01)
    assert twin.support_height(np.array([2.9, 2.7, 1.0])) == pytest.approx(0.4, abs=0.01)


def test_who_is_not_there_is_an_error(twin):
    with pytest.raises(KeyError, match="no person 'ben'"):
        twin.move_people({"ben": person(hand(1.0))["ann"]})
    assert People({}).targets == {}


def test_heights_are_those_below():
    shelf = block((1, 1, 1.0), (2, 2, 1.04))
    surface = surface_of(np.concatenate([ROOM, shelf]))
    for place, height in (((1.5, 1.5, 2.0), 1.04), ((1.5, 1.5, 0.9), 0.0), ((0.5, 0.5, 2.0), 0.0)):
        assert height_below(surface, np.array(place), gap_m=0.0) == pytest.approx(height, abs=2e-3)


def test_turned_triangles_are_turned_back():
    rng = np.random.default_rng(1)
    some = rng.random(len(ROOM)) < 0.4
    mixed = np.where(some[:, None, None], ROOM[:, ::-1], ROOM)
    for faulty in (mixed, ROOM[:, ::-1]):
        fixed = turn_to_free_side(faulty)
        up = np.cross(fixed[:, 1] - fixed[:, 0], fixed[:, 2] - fixed[:, 0])
        inward = np.einsum("nk,nk->n", up, (2.0, 1.5, 1.25) - fixed.mean(axis=1))
        assert (inward > 0.0).all()
    assert len(turn_to_free_side(np.zeros((3, 3, 3)))) == 0
