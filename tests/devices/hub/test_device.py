"""Headsets as their pages say them: read, kept with who wears them, and how old it is."""

import pytest

from devices.hub.attendance import AWAY_NS
from devices.hub.fields import MessageError
from devices.hub.messages import MAX_MODEL, DeviceSaid, Immersion, read_device
from devices.hub.session import Visit
from devices.hub.wire import Body, encode_body
from scenes.pose import Pose

SAID = {
    "kind": "device",
    "model": "Quest 3",
    "immersion": "vr",
    "worn": True,
    "hz": 71.9,
    "battery": 62,
    "charging": False,
}


def test_a_headset_is_read_as_it_is_said():
    assert read_device(SAID) == DeviceSaid("Quest 3", Immersion.VR, True, 71.9, 62.0, False)
    least = read_device({"kind": "device", "immersion": "none", "hz": None, "battery": None})
    assert least == DeviceSaid("", Immersion.NONE, False, None, None, False)
    assert (
        read_device({**SAID, "model": "\x1b<b>" + 99 * "x"}).model == "<b>" + (MAX_MODEL - 4) * "x"
    )


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("model", 3),
        ("immersion", "mr"),
        ("immersion", None),
        ("worn", 1),
        ("hz", -1),
        ("hz", 1e9),
        ("hz", float("nan")),
        ("battery", 101),
        ("battery", "full"),
        ("charging", "yes"),
    ],
)
def test_what_cannot_be_is_refused_with_what_is_wanted(field, value):
    with pytest.raises(MessageError, match=field):
        read_device({**SAID, field: value})


def test_a_hub_knows_headsets_of_who_is_here_and_their_ages(room):
    anna, hers, _ = room.join("Anna")
    room.join("Ben")
    assert room.session.attendance.headsets(room.now_ns) == ()
    room.hear(anna, hers, **SAID)
    body = encode_body(Body(1, 1, Pose.identity()))
    room.now_ns += 2 * 10**9
    room.session.see_body(Visit(anna, hers), body, now_ns=room.now_ns)
    room.now_ns += 10**8
    (found,) = room.session.attendance.headsets(room.now_ns)
    assert (found.person.name, found.said.battery_percent) == ("Anna", 62.0)
    assert (found.said_age_s, found.body_age_s) == (2.1, 0.1)
    assert [it for it in room.drain(hers) if it.get("kind") == "refused"] == []
    room.hear(anna, hers, **{**SAID, "battery": 500})
    assert room.session.attendance.headsets(room.now_ns)[0].said.battery_percent == 62.0
    room.session.leave(Visit(anna, hers), room.now_ns)
    assert not room.session.attendance.headsets(room.now_ns)[0].person.is_connected
    room.now_ns += AWAY_NS
    assert room.session.attendance.headsets(room.now_ns) == ()
