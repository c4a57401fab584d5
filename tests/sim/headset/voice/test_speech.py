"""People who speak and hear, over a hub: by the WebSocket, by WebRTC, and those who do neither."""

import asyncio
from types import SimpleNamespace

import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from sim.headset.connection import HubAddress
from sim.headset.crowd import CrowdPlan
from sim.headset.voice.speech import NO_SPEECH, Speech
from tests.sim.headset.conftest import lasting, play


@pytest.fixture
def hub():
    hub = Hub(HubSettings(), {"/": Asset(b"page", "text/html")}, clock=WallClock())
    hub.start()
    yield hub
    hub.close()


def crowd(hub, speech, until):
    async def codes():
        while True:
            yield hub.invite().code

    room = SimpleNamespace(publish=lambda: None)
    plan = CrowdPlan(HubAddress(hub.url), 3, rate_hz=10.0, draws=False, speech=speech)
    return asyncio.run(play(room, plan, until=until, codes=codes()))


def test_two_speak_and_all_three_hear_over_the_websocket(hub):
    def are_heard(tally, _pace):
        return tally.spoken > 100 and tally.heard > 1.5 * tally.spoken

    tally, pace = crowd(hub, Speech(2), are_heard)
    assert tally.failures == []
    assert tally.voice.percentile(95) < 250 + 2 * pace.late_ms
    assert tally.unreadable == 0


def test_two_speak_by_webrtc(hub):
    pytest.importorskip("aiortc")
    tally, _ = crowd(
        hub, Speech(2, is_rtc=True), lambda tally, _pace: min(tally.spoken, tally.heard) > 50
    )
    assert tally.failures == []


def test_who_does_not_speak_neither_hears_nor_begins_anything(hub):
    assert not NO_SPEECH.is_on
    assert Speech(2).of(1).speaks
    assert not Speech(2).of(2).speaks
    tally, _ = crowd(hub, NO_SPEECH, lasting(1.0))
    assert (tally.spoken, tally.heard) == (0, 0)
    assert hub._media is None or hub._media.process_id is None
