"""People who speak and hear, over a hub: by the WebSocket, by WebRTC, and those who do neither."""

import asyncio

import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from sim.headset.connection import HubAddress
from sim.headset.crowd import CrowdPlan, run_crowd
from sim.headset.speech import NO_SPEECH, Speech


@pytest.fixture
def hub():
    hub = Hub(HubSettings(), {"/": Asset(b"page", "text/html")}, clock=WallClock())
    hub.start()
    yield hub
    hub.close()


def crowd(hub, speech, *, seconds=4.0):
    async def codes():
        while True:
            yield hub.invite().code

    plan = CrowdPlan(HubAddress(hub.url), 3, seconds, rate_hz=10.0, draws=False, speech=speech)
    return asyncio.run(run_crowd(plan, codes(), over=asyncio.Event()))


def test_two_speak_and_all_three_hear_over_the_websocket(hub):
    tally = crowd(hub, Speech(2))
    assert tally.failures == []
    assert tally.spoken > 100
    assert tally.heard > 1.5 * tally.spoken
    assert tally.voice.percentile(95) < 250
    assert tally.unreadable == 0


def test_two_speak_by_webrtc(hub):
    pytest.importorskip("aiortc")
    tally = crowd(hub, Speech(2, is_rtc=True), seconds=8.0)
    assert tally.failures == []
    assert tally.spoken > 50
    assert tally.heard > 50


def test_who_does_not_speak_neither_hears_nor_begins_anything(hub):
    assert not NO_SPEECH.is_on
    assert Speech(2).of(1).speaks
    assert not Speech(2).of(2).speaks
    tally = crowd(hub, NO_SPEECH, seconds=1.0)
    assert (tally.spoken, tally.heard) == (0, 0)
    assert hub._media is None or hub._media.process_id is None
