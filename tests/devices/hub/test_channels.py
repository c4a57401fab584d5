"""Newest state, ordered log and newest bodies, without a socket."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from devices.hub import channels
from devices.hub.channels import BodyChannel, LogChannel, StateChannel, to_text
from devices.hub.protocol.wire import pack_item
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState


def tracked(name, pose=None, confidence=0.9):
    return TrackedObject(
        name, 5_000, pose or Pose.identity(), np.eye(4), 1.0, TrackState.TRACKED, confidence, 1
    )


def state_of(*objects, t_ns=7_000):
    return SceneState(1, t_ns, {it.object_id: it for it in objects})


def test_an_object_stands_upright_on_the_wire_where_it_does_in_the_room():
    channel = StateChannel()
    channel.take(state_of(tracked("cup", Pose.from_yaw(math.pi / 2, (1, 2, 3)))))
    x, y, z, *turn, word, confidence = json.loads(channel.whole())["cup"]
    assert (x, y, z) == (1, 3, -2)
    assert turn == pytest.approx([0, math.sqrt(0.5), 0, math.sqrt(0.5)], abs=1e-6)
    assert (word, confidence) == ("tracked", 0.9)


def test_a_message_holds_only_what_has_changed():
    channel = StateChannel()
    cup, pen = tracked("cup"), tracked("pen")
    assert channel.take(state_of(cup, pen))
    assert channel.take(state_of(cup, tracked("pen", Pose.from_yaw(0, (1, 0, 0)))))
    first, second = (json.loads(channel.message_since(v)) for v in (0, 1))
    assert set(first["objects"]) == {"cup", "pen"}
    assert set(second["objects"]) == {"pen"}
    assert second["version"] == 2
    assert second["t_us"] == 7
    assert json.loads(channel.message_since(2))["objects"] == {}


def test_a_state_in_which_nothing_moved_is_no_version():
    channel = StateChannel()
    state = state_of(tracked("cup"))
    channel.take(state)
    assert not channel.take(state)
    assert not channel.take(state_of(tracked("cup")))
    assert not channel.take(replace(state, version=9))
    assert channel.version == 1


def test_the_camera_is_said_where_it_has_moved():
    channel = StateChannel()
    state = state_of(tracked("cup"))
    assert channel.take(replace(state, world_from_rig=Pose.from_yaw(0.5, (1, 2, 3))))
    assert json.loads(channel.message_since(0))["camera"] == [1, 3, -2]
    assert not channel.take(replace(state, world_from_rig=Pose.from_yaw(0.6, (1.01, 2, 3))))
    assert "camera" not in json.loads(channel.message_since(1))
    assert channel.take(replace(state, world_from_rig=Pose.from_yaw(0.6, (1.1, 2, 3))))
    assert json.loads(channel.message_since(1)) == {
        **{"kind": "state", "version": 2, "t_us": 7, "objects": {}},
        "camera": [1.1, 3, -2],
    }


def test_an_object_that_is_gone_is_said_once():
    channel = StateChannel()
    channel.take(state_of(tracked("cup"), tracked("pen")))
    channel.take(state_of(tracked("cup")))
    assert json.loads(channel.message_since(1))["objects"] == {"pen": None}
    assert set(json.loads(channel.whole())) == {"cup"}
    channel.take(state_of(tracked("cup"), tracked("pen")))
    assert set(json.loads(channel.message_since(2))["objects"]) == {"pen"}


def test_a_name_can_be_anything_and_confidence_not_a_number():
    channel = StateChannel()
    channel.take(state_of(tracked('"<\n', confidence=float("nan"))))
    assert json.loads(channel.message_since(0))["objects"]['"<\n'][-1] == 0.0


def test_names_of_what_is_gone_are_forgotten_in_the_end(monkeypatch):
    monkeypatch.setattr(channels, "MAX_OBJECTS", 10)
    channel = StateChannel()
    for number in range(50):
        channel.take(state_of(tracked(f"object {number}")))
    assert len(channel._texts) <= 10
    assert set(json.loads(channel.whole())) == {"object 49"}


def test_the_log_is_resent_from_where_it_is_known():
    log = LogChannel()
    texts = [log.add({"op": "line", "n": n}) for n in range(5)]
    assert [json.loads(text)["seq"] for text in texts] == [1, 2, 3, 4, 5]
    assert log.since(0) == texts
    assert log.since(3) == texts[3:]
    assert log.since(5) == []
    assert log.since(6) is None


@pytest.mark.parametrize(("name", "limit"), [("MAX_LOG_ENTRIES", 10), ("MAX_LOG_BYTES", 500)])
def test_the_log_keeps_the_newest(monkeypatch, name, limit):
    monkeypatch.setattr(channels, name, limit)
    log = LogChannel()
    for number in range(100):
        log.add({"op": "line", "n": number})
    assert log.since(0) is None
    kept = log.since(95)
    assert kept is not None
    assert len(kept) == 5
    assert len(log._entries) <= 20
    assert log._bytes == sum(len(text) for _seq, text in log._entries)


def test_bodies_newer_than_the_last_look_but_ones_own():
    bodies = BodyChannel()
    bodies.put(1, b"a")
    bodies.put(2, b"b")
    seen = bodies.counter
    bodies.put(2, b"c")
    bodies.put(2, b"d")
    assert bodies.since(0, but=1) == [(2, 3, pack_item(2, b"d"))]
    assert sorted(bodies.since(0, but=9)) == [
        (1, 1, pack_item(1, b"a")),
        (2, 3, pack_item(2, b"d")),
    ]
    assert bodies.since(seen, but=9) == [(2, 3, pack_item(2, b"d"))]
    bodies.drop(2)
    bodies.drop(7)
    assert bodies.since(0, but=9) == [(1, 1, pack_item(1, b"a"))]


def test_texts_are_json_without_what_is_no_number():
    assert to_text({"a": [1, 2]}) == '{"a":[1,2]}'
    with pytest.raises(ValueError, match="Out of range"):
        to_text({"a": float("nan")})
