import asyncio
from dataclasses import replace

import numpy as np
import pytest

from devices.hub.entities.drawn import GLTF_FROM_WORLD
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose
from sim.headset.connection import HubAddress
from sim.headset.crowd import CrowdPlan
from sim.headset.scripted import Script, ScriptedPerson, scripts_of
from sim.people.remote import remote_avatar
from sim.scenarios.scenario import RemoteDrawing, RemoteSettings, load_scenario
from tests.sim.headset.conftest import play

ALONG = ((-1.0, 0.0, 1.6), (1.0, 0.0, 1.6))
LINE = RemoteDrawing(((0.0, 0.0, 1.0), (1.0, 0.0, 1.0)), 0.2, 0.5, (1.0, 0.5, 0.0))


def on_the_wire(pose):
    """An object's values as a hub's state has them."""
    room_from_object = GLTF_FROM_WORLD @ pose @ WORLD_FROM_GLTF
    w, x, y, z = room_from_object.quaternion()
    return [*room_from_object.translation, x, y, z, w, "static", 1.0]


def test_they_point_where_the_studio_shows_the_object():
    settings = RemoteSettings("grace", ALONG, points_at=("chair",))
    person = ScriptedPerson(Script(settings, 10.0))
    chair = Pose.from_yaw(0.7, (0.4, 1.1, 0.0))
    person.take_whole({"chair": on_the_wire(Pose.from_yaw(0.0))})
    person.take({"chair": on_the_wire(chair)})
    body = person.body(1.0, seq=3, t_us=5)
    wanted = remote_avatar(settings, 0.1, {"chair": chair}, Pose.from_yaw(0.0))
    assert (body.seq, body.t_us) == (3, 5)
    assert WORLD_FROM_GLTF @ body.ray == pytest.approx(wanted.ray, abs=1e-9)
    head = WORLD_FROM_GLTF @ body.room_from_head.translation
    assert head == pytest.approx(wanted.world_from_head.translation, abs=1e-9)


def test_what_is_gone_is_not_pointed_at():
    settings = RemoteSettings("grace", ALONG, points_at=("chair",))
    person = ScriptedPerson(Script(settings, 10.0))
    person.take_whole({"chair": on_the_wire(Pose.from_yaw(0.0))})
    person.take({"chair": None})
    assert person.body(1.0, seq=0, t_us=0).ray is None


def test_at_the_end_they_stay():
    person = ScriptedPerson(Script(RemoteSettings("grace", ALONG), 10.0))
    last, later = (person.body(t, seq=0, t_us=0).room_from_head for t in (10.0, 99.0))
    assert np.array_equal(last.translation, later.translation)
    assert WORLD_FROM_GLTF @ last.translation == pytest.approx(ALONG[-1])


def test_lines_grow_and_are_sent_once():
    person = ScriptedPerson(Script(RemoteSettings("grace", ALONG, draws=(LINE,)), 10.0))
    assert person.new_things(0.1) == []
    half, whole = person.new_things(0.45)[0], person.new_things(0.8)[0]
    assert half["line"] == whole["line"] == "grace-1"
    assert WORLD_FROM_GLTF @ np.array(half["points"])[-1] == pytest.approx((0.5, 0.0, 1.0))
    assert WORLD_FROM_GLTF @ np.array(whole["points"])[-1] == pytest.approx((1.0, 0.0, 1.0))
    assert person.new_things(0.9) == []


def test_a_scenario_without_remote_people_is_refused():
    with pytest.raises(ValueError, match=r"nobody watches from elsewhere; add \[\[remote\]\]"):
        scripts_of(replace(load_scenario("lab-short"), remote=()))


def test_people_of_a_scenario_join_as_themselves_and_their_lines_arrive(hub):
    settings = RemoteSettings("grace", ALONG, points_at=("chair-1",), draws=(LINE,))
    plan = CrowdPlan(HubAddress(hub.url), scripts=(Script(settings, 10.0),))
    avatars, lines = [], {}

    def has_drawn(_tally, _pace):
        arrived = hub.hub.take()
        avatars[:] = arrived.avatars or avatars
        lines.update({line.annotation_id: line for line in arrived.lines})
        ends = [line.points_in_world[-1, 0] for line in lines.values()]
        return avatars and any(end > 0.99 for end in ends)

    async def codes():
        yield hub.hub.invite().code

    tally, _ = asyncio.run(play(hub, plan, until=has_drawn, codes=codes()))
    assert tally.failures == []
    assert tally.refused == 0
    assert [avatar.user_id for avatar in avatars] == ["p1"]
    assert avatars[0].ray is not None
    (line,) = lines.values()
    assert line.annotation_id == "p1/grace-1"
    assert line.points_in_world[-1] == pytest.approx((1.0, 0.0, 1.0), abs=1e-3)
