"""A crowd in a session, for a moment: its figures are of what it sent."""

import asyncio
import json

import aiohttp
import pytest

from benchmarks.wire import hub_load
from benchmarks.wire.crowd import STAMPS, STAMPS_AT, Orders, _Crowd
from benchmarks.wire.hub_load import load_hub
from devices.hub.protocol.wire import decode_body
from sim.wire.people_messages import valid_bodies


def test_a_small_crowd():
    figures = load_hub(3, hz=30.0, seconds=1.0)
    crowd = figures.crowd
    assert 0 < crowd.sent <= 180, "90 where the machine is free"
    assert 0 < crowd.received <= 2 * (crowd.sent + 6), "fewer where the machine is busy"
    assert 0 < crowd.bundles <= crowd.received
    assert crowd.states > 0
    p50, p95, p99, most = crowd.latency_ms
    assert 0 < p50 <= p95 <= p99 <= most
    assert figures.refused == 0
    assert figures.sent_bytes > 100_000
    assert 0 < figures.publish_ms[0] <= figures.publish_ms[1]


def test_stamps_are_where_a_body_has_them():
    data = bytearray(valid_bodies()[0])
    STAMPS.pack_into(data, STAMPS_AT, 5, 6)
    body = decode_body(bytes(data))
    assert (body.seq, body.t_us) == (5, 6)


def test_a_crowd_that_fails_is_an_error(monkeypatch):
    monkeypatch.setattr(hub_load, "module_command", lambda _name: ["/bin/sh", "-c", "exit 3"])
    with pytest.raises(OSError, match=r"the crowd has failed|Broken pipe"):
        load_hub(2, hz=10.0, seconds=1.0)


class Goodbye:
    """A socket that says goodbye."""

    async def __aiter__(self):
        text = json.dumps({"kind": "bye", "why": "too much"})
        yield aiohttp.WSMessage(aiohttp.WSMsgType.TEXT, text, "")


def test_people_who_are_sent_away_say_why():
    crowd = _Crowd(Orders("http://x", 1, 1.0, 1.0))
    with pytest.raises(OSError, match="sent away: too much"):
        asyncio.run(crowd._read(Goodbye()))
