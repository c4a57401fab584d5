"""The wearer among a session's people."""

import numpy as np

from devices.hub.contract import Arrived
from devices.hub.protocol.wire import decode_body
from devices.hub.roles import can_have_shapes
from scenes.pose import Pose
from scenes.state import Avatar, SceneState
from studio.live.hololens.local_user import WEARER, WithLocalUser, show_to, wearer_now


class Inner:
    def __init__(self):
        self.published, self.shown = [], []

    def take(self):
        return Arrived(
            avatars=(Avatar("p1", "remote", Pose.identity()),), events=(("joined", "x"),)
        )

    def publish(self, state):
        self.published.append(state)

    def show(self, surface_id, jpeg):
        self.shown.append(surface_id)


class Hub:
    def meet(self, others, *, way="sites"):
        self.met = (others, way)


def people(inner, avatar):
    seen = []
    made = WithLocalUser(
        inner, wearer=lambda: avatar, take_events=lambda: (("a", "b"),), publish=seen.append
    )
    return made, seen


def test_the_wearer_comes_with_the_others():
    one = Avatar(WEARER, "local", Pose.identity())
    everybody, _ = people(Inner(), one)
    arrived = everybody.take()
    assert [a.user_id for a in arrived.avatars] == ["p1", WEARER]
    assert arrived.events == (("joined", "x"), ("a", "b"))


def test_without_a_hub_there_is_the_wearer_alone():
    everybody, seen = people(None, None)
    assert everybody.take().avatars == ()
    everybody.publish(SceneState())
    everybody.show("s", b"")
    assert len(seen) == 1


def test_states_and_pictures_go_to_all():
    inner = Inner()
    everybody, seen = people(inner, None)
    everybody.publish(SceneState())
    everybody.show("s", b"")
    assert len(inner.published) == len(seen) == 1
    assert inner.shown == ["s"]


def test_a_hub_shows_the_wearer_once_it_is_known_where_they_are(sample_of):
    hub, one = Hub(), sample_of()
    show_to(hub, one, device_from_world=None, name="Ana")
    assert hub.met[1] == WEARER
    assert hub.met[0][0].body == b""
    show_to(hub, one, device_from_world=Pose.identity(), name="Ana")
    (shown,), _ = hub.met
    assert shown.person.name == "Ana"
    assert np.isfinite(decode_body(shown.body).ray).all()
    assert wearer_now(None, Pose.identity(), name="") is None
    assert wearer_now(one, Pose.identity(), name="Ana").name == "Ana"


def test_a_wearer_can_be_given_shapes_and_yields_them(sample_of):
    hub = Hub()
    show_to(hub, sample_of(), device_from_world=Pose.identity(), name="Ana")
    (shown,), _ = hub.met
    assert can_have_shapes(shown.person)
    assert shown.person.is_yielding
