"""Shapes that are the wearer's in the wearer's hands, with and without a hub behind them."""

import json
from dataclasses import replace
from random import Random

import numpy as np
import pytest

from devices.hololens.values import HandJoints, HeadAndHands, Joint
from devices.hub.elsewhere import Elsewhere
from devices.hub.entry.pairing import PairingCodes
from devices.hub.entry.tokens import Tokens
from devices.hub.protocol.messages import Hello
from devices.hub.protocol.wire import Body, Hand, encode_body
from devices.hub.roles import Person, Role
from devices.hub.session import Session
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose
from scenes.state import Avatar, SceneState, SharedPrimitive
from studio.live.hololens.carrying import (
    FACE_M,
    LOST_NS,
    REACH_M,
    SEND_NS,
    SETTLES_NS,
    Carrying,
    Hands,
    hands_after,
    metres_to,
    taker_at,
)
from studio.live.hololens.local_user import WEARER

DEVICE_FROM_WORLD = Pose.from_yaw(0.5, (0.3, -0.2, -1.5))
WORLD_FROM_DEVICE = DEVICE_FROM_WORLD.inverse()
AT = np.array([0.4, 0.2, 1.1])


def shape(place=AT, *, user_id=WEARER, key="p1/a"):
    pose = Pose.from_yaw(0.3, place)
    return SharedPrimitive(key, user_id, "box", (0.2, 0.1, 0.3), (1.0, 0.0, 0.0), pose)


def hand(place, *, gap_m, yaw=0.0):
    """A hand whose thumb and index finger meet at a place of the room, in the headset's world."""
    places = np.tile(np.asarray(place, dtype=float), (26, 1))
    places[Joint.THUMB_TIP][0] -= 0.5 * gap_m
    places[Joint.INDEX_TIP][0] += 0.5 * gap_m
    turn = (DEVICE_FROM_WORLD @ Pose.from_yaw(yaw, (0, 0, 0))).rotation
    return HandJoints(
        DEVICE_FROM_WORLD @ places, np.tile(turn, (26, 1, 1)), np.full(26, 0.01), np.ones(26, bool)
    )


def sample(right=None, left=None):
    return HeadAndHands(0, 0, 0, Pose.identity(), None, left, right)


def after(hands, given, *, own=(), now_ns=0):
    return hands_after(hands, given, own=own, world_from_device=WORLD_FROM_DEVICE, now_ns=now_ns)


def test_a_pinch_takes_what_is_near_and_it_goes_and_turns_with_the_hand():
    own = [shape(), shape(AT + np.array([1.0, 0, 0]), key="p1/far")]
    hands = after(Hands(), sample(hand(AT, gap_m=0.06)), own=own)
    assert hands.held is None, "an open hand takes nothing"
    hands = after(hands, sample(hand(AT, gap_m=0.01)), own=own)
    assert (hands.held.primitive.primitive_id, hands.held.side) == ("p1/a", 1)
    hands = after(hands, sample(hand(AT + np.array([0.5, 0, 0.2]), gap_m=0.025, yaw=0.4)), own=own)
    pose = hands.held.primitive.world_from_primitive
    wanted = Pose.from_yaw(0.4, AT + np.array([0.5, 0, 0.2])) @ Pose.from_yaw(0.3, (0, 0, 0))
    assert np.allclose(pose.matrix(), wanted.matrix())
    hands = after(hands, sample(hand(AT, gap_m=0.031)), own=own)
    assert hands.held is None


def test_a_hand_that_closes_elsewhere_and_then_comes_takes_nothing():
    own = [shape()]
    away = AT + np.array([0.1 + REACH_M + 0.03, 0, 0])
    hands = after(Hands(), sample(hand(away, gap_m=0.01)), own=own)
    assert hands.held is None
    hands = after(hands, sample(hand(AT, gap_m=0.01)), own=own)
    assert hands.held is None
    assert after(Hands(), sample(hand(AT, gap_m=0.01)), own=[]).held is None


def test_a_hand_that_is_out_of_sight_has_let_go_after_a_while():
    hands = after(Hands(), sample(hand(AT, gap_m=0.01)), own=[shape()], now_ns=5)
    assert after(hands, sample(), now_ns=LOST_NS).held is hands.held
    assert after(hands, None, now_ns=LOST_NS + 5).held is None


def person(user_id, head, *hands):
    return Avatar(user_id, "remote", Pose.from_yaw(0.0, head), tuple(hands))


def test_it_is_somebodys_whose_hand_or_handless_head_is_at_it():
    one = shape()
    assert metres_to(one, AT + np.array([0, 0, 0.1])) == 0.0
    edge = one.world_from_primitive @ np.array([0.1 + REACH_M - 0.01, 0.0, 0.1])
    beyond = one.world_from_primitive @ np.array([0.1 + REACH_M + 0.01, 0.0, 0.1])
    near = person("near", (5, 5, 5), np.tile(edge, (25, 1)))
    far = person("far", AT, np.tile(beyond, (25, 1)))
    assert taker_at(one, [far, near]) == "near"
    assert taker_at(one, [far]) is None, "whoever shows hands takes by hand"
    face = one.world_from_primitive @ np.array([0.1 + FACE_M - 0.01, 0.0, 0.1])
    assert taker_at(one, [person("face", face)]) == "face"
    assert taker_at(one, [person("face", beyond + np.array([1.0, 0, 0]))]) is None


class Room:
    """A session of a hub without sockets, with the wearer and two people in it."""

    def __init__(self):
        self.now_ns = 10**12
        self.session = Session(
            max_people=8,
            codes=PairingCodes(Random(0).randrange),
            tokens=Tokens(Random(1).randbytes),
            say=lambda _text: None,
            now_ns=self.now_ns,
        )
        wearer = Person(WEARER, 0, "Ana", Role.LOCAL, is_yielding=True)
        self.session.meet([Elsewhere(wearer, b"")], self.now_ns, way=WEARER)
        self.visits = [self._join(name) for name in ("Bea", "Cleo")]
        self.noted = []
        self.carrying = Carrying(WEARER, hub=lambda: self, note=lambda *it: self.noted.append(it))
        self.state = SceneState()

    def act(self, person_id, do):
        self.session.act(person_id, do, now_ns=self.now_ns)

    def bodies(self):
        return self.session.attendance.shown(self.now_ns)

    def elsewhere(self, *, but):
        return self.session.others.by_other_ways(but)

    def do(self, number, **fields):
        text = json.dumps({"kind": "do", "id": 1, **fields})
        self.session.hear(self.visits[number], text, now_ns=self.now_ns)
        self.look()

    def reach(self, number, place):
        """Let somebody hold the right hand at a place of the room."""
        joints = np.tile(WORLD_FROM_GLTF.inverse() @ np.asarray(place, float), (25, 1))
        body = Body(1, 1, Pose.identity(), hands=(None, Hand(joints, np.full(25, 0.01))))
        self.session.see_body(self.visits[number], encode_body(body), now_ns=self.now_ns)

    def look(self):
        """Take what has changed into the state, as a session does with the next picture."""
        there = dict(self.state.primitives)
        there |= {it.primitive_id: it for it in self.session.take().placed}
        self.state = replace(self.state, primitives=there)
        self.session.publish(self.state)
        self.carrying.publish(self.state)

    def step(self, right):
        self.now_ns += SEND_NS
        self.carrying.step(sample(right), device_from_world=DEVICE_FROM_WORLD, now_ns=self.now_ns)

    def _join(self, name):
        code, _ = self.session.codes.make(Role.REMOTE, self.now_ns)
        token = self.session.pair(code, name=name, address="10.0.0.1", now_ns=self.now_ns)
        return self.session.enter(Hello(token, None, None), address="10.0.0.1", now_ns=self.now_ns)


@pytest.fixture
def room():
    made = Room()
    x, y, z = (WORLD_FROM_GLTF.inverse() @ AT).tolist()
    pose = [x, y, z, 0, 0, 0, 1]
    made.do(0, op="primitive", primitive="a", shape="box", size=[0.2, 0.3, 0.1], pose=pose)
    return made


def owner(room):
    room.look()
    return room.state.primitives["p1/a"].user_id


def test_the_wearer_carries_what_they_were_given_and_hands_it_on(room):
    room.step(hand(AT, gap_m=0.01))
    assert room.carrying.shown(room.now_ns) is None, "it is not theirs yet"
    room.do(0, op="give", primitive="p1/a", to=WEARER)
    room.step(hand(AT, gap_m=0.06))
    room.step(hand(AT, gap_m=0.01))
    to = AT + np.array([0.6, 0.1, 0.0])
    room.step(hand(to, gap_m=0.01))
    assert np.allclose(room.carrying.shown(room.now_ns).world_from_primitive.translation, to)
    assert owner(room) == WEARER
    assert np.allclose(
        room.state.primitives["p1/a"].world_from_primitive.translation, to, atol=1e-3
    )
    # Let go where nobody is, it stays the wearer's.
    room.step(hand(to, gap_m=0.06))
    assert owner(room) == WEARER
    assert room.carrying.shown(room.now_ns) is not None
    assert room.carrying.shown(room.now_ns + SETTLES_NS) is None
    # Let go at Cleo's hand, it is hers; what her hand reaches is not the wearer's to take again.
    room.step(hand(to, gap_m=0.01))
    room.reach(0, to + np.array([2.0, 0, 0]))
    room.reach(1, to)
    room.step(hand(to, gap_m=0.06))
    assert owner(room) == "p2"
    room.step(hand(to, gap_m=0.01))
    assert room.carrying._hands.held is None
    assert room.noted == []


def test_a_shape_that_somebody_asked_for_leaves_the_hand(room):
    room.do(0, op="give", primitive="p1/a", to=WEARER)
    room.step(hand(AT, gap_m=0.01))
    room.do(1, op="give", primitive="p1/a", to="p2")
    assert owner(room) == WEARER, "a hand has it"
    room.step(hand(AT, gap_m=0.06))
    room.now_ns += 10**9
    room.do(1, op="give", primitive="p1/a", to="p2")
    room.step(hand(AT, gap_m=0.01))
    assert owner(room) == "p2"


def test_a_refusal_ends_the_grip_and_is_said_once(room):
    room.do(0, op="give", primitive="p1/a", to=WEARER)
    room.session.give_pen("p1", room.now_ns)
    room.step(hand(AT, gap_m=0.01))
    assert room.carrying._hands.held is None
    room.step(hand(AT, gap_m=0.01))
    ((kind, text),) = room.noted
    assert kind == "refused"
    assert "somebody else has the pen" in text


def test_a_lost_headset_moves_nothing(room):
    room.do(0, op="give", primitive="p1/a", to=WEARER)
    room.step(hand(AT, gap_m=0.01))
    room.step(hand(AT + np.array([5000.0, 0, 0]), gap_m=0.01))
    room.look()
    assert abs(room.state.primitives["p1/a"].world_from_primitive.translation).max() < 2.0
    room.carrying.step(sample(), device_from_world=None, now_ns=room.now_ns)
    assert room.carrying._hands.held is None
