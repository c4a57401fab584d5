"""Bodies, lines and surfaces in the session's own types and axes."""

from dataclasses import replace

import numpy as np
import pytest

from devices.hub import inbox as module
from devices.hub.entities.drawn import ROOM, Drawn
from devices.hub.inbox import MAX_EVENTS, Avatars, Inbox, avatar_of
from devices.hub.protocol.wire import Body, Controller, Hand
from devices.hub.roles import Op, Person, Role
from scenes.pose import Pose

ANNA = Person("p1", 1, "Anna", Role.REMOTE)


@pytest.fixture
def inbox():
    return Inbox()


def line(key, x):
    return Drawn(Op.LINE, key, "p1", np.full((2, 3), float(x)))


def test_a_head_looks_where_it_does_in_the_room():
    """At 1.6 m, 3 m in front of the origin, looking north (-z on the wire, +y in the world)."""
    avatar = avatar_of(Body(1, 2, Pose.from_quaternion((1, 0, 0, 0), (0, 1.6, -3))), ANNA)
    np.testing.assert_allclose(avatar.world_from_head.translation, [0, 3, 1.6])
    right, down, ahead = avatar.world_from_head.rotation.T
    np.testing.assert_allclose(right, [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(down, [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(ahead, [0, 1, 0], atol=1e-12)
    assert (avatar.user_id, avatar.role, avatar.hands, avatar.ray) == ("p1", "remote", (), None)


def test_hands_controllers_and_ray():
    pose = Pose.from_quaternion((1, 0, 0, 0), (1, 2, 3))
    hand = Hand(np.tile([1.0, 2.0, 3.0], (25, 1)), np.zeros(25))
    body = Body(
        1,
        2,
        pose,
        (Controller(pose, pose), Controller(pose, pose)),
        (hand, None),
        np.array([[0, 0, 0], [0, 1, -2.0]]),
    )
    avatar = avatar_of(body, Person("p2", 2, "Ben", Role.LOCAL))
    assert avatar.role == "local"
    left, right = avatar.hands
    assert (left.shape, right.shape) == ((25, 3), (1, 3))
    np.testing.assert_allclose(left[0], [1, -3, 2])
    np.testing.assert_allclose(right[0], [1, -3, 2])
    np.testing.assert_allclose(avatar.ray, [[0, 0, 0], [0, 2, 1]])


def test_a_body_without_a_head_is_nobody():
    assert avatar_of(Body(1, 2, None), ANNA) is None


def test_the_newest_of_each_line_is_taken_once(inbox):
    for x in range(3):
        inbox.draw(line("p1/a", x))
    inbox.draw(line("p1/b", 9))
    inbox.draw(Drawn(Op.SURFACE, "p1/a", "p1", np.zeros((4, 3))))
    arrived = inbox.take()
    assert [it.annotation_id for it in arrived.lines] == ["p1/a", "p1/b"]
    assert arrived.lines[0].points_in_world[0, 0] == 2
    assert [it.surface_id for it in arrived.surfaces] == ["p1/a"]
    again = inbox.take()
    assert (again.lines, again.surfaces) == ((), ())
    assert inbox.recognise((Op.LINE, "p1/a"), arrived.lines[0])
    assert inbox.recognise((Op.LINE, "p1/a"), arrived.lines[0])
    assert not inbox.recognise((Op.LINE, "p1/a"), line("p1/a", 2).entity())


def test_of_a_line_that_grows_nothing_is_held_but_what_the_state_may_still_show(inbox):
    handed = []
    for x in range(1, 2000):
        inbox.draw(line("p1/a", x))
        handed += inbox.take().lines
        if x % 10 == 0:  # the state lags behind, and skips
            assert inbox.recognise((Op.LINE, "p1/a"), handed[-5])
            assert not inbox.recognise((Op.LINE, "p1/a"), handed[-6])
    assert inbox.recognise((Op.LINE, "p1/a"), handed[-2])
    assert inbox.recognise((Op.LINE, "p1/a"), handed[-1])
    assert inbox._remembered == 1
    inbox.draw(Drawn(Op.LINE, "p1/a", "p1"))
    inbox.take()
    inbox.draw(line("p1/a", 1))
    (again,) = inbox.take().lines
    inbox.see_end(Drawn(Op.LINE, "p1/a", ROOM))
    assert inbox._remembered == 1
    assert inbox.recognise((Op.LINE, "p1/a"), again)
    inbox.see_end(Drawn(Op.LINE, "p1/b", ROOM))


def test_each_body_is_decoded_once(body_at):
    avatars = Avatars()
    data = body_at(1.0)
    (first,) = avatars.of([(ANNA, data)])
    (same,) = avatars.of([(ANNA, data)])
    assert same is first
    (newer,) = avatars.of([(ANNA, body_at(2.0))])
    assert newer.world_from_head.translation[0] == 2
    (local,) = avatars.of([(replace(ANNA, role=Role.LOCAL), data)])
    assert local.role == "local"
    assert avatars.of([]) == ()


def test_what_waits_has_a_limit(inbox, monkeypatch):
    monkeypatch.setattr(module, "MAX_CHANGES", 5)
    for number in range(20):
        inbox.draw(line(f"p1/{number}", 0))
    for number in range(2 * MAX_EVENTS):
        inbox.note("joined", str(number))
    arrived = inbox.take()
    assert [it.annotation_id for it in arrived.lines] == [f"p1/{n}" for n in range(15, 20)]
    assert len(arrived.events) == MAX_EVENTS
    assert arrived.events[-1] == ("joined", str(2 * MAX_EVENTS - 1))
    inbox.draw(line("p1/x", 0))
    inbox.take()
    assert len(inbox._handed) == 5
