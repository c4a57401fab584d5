"""A simulated headset's WebRTC: its offer is one that the hub reads, and its voice has a pace."""

import asyncio
import time

import pytest

pytest.importorskip("aiortc")

from aiortc.mediastreams import MediaStreamError

from devices.hub.media.offer import read_offer
from sim.headset.voice.peer import ToneTrack, VoicePeer
from sim.headset.voice.tone import ToneVoice


def test_its_offer_is_as_the_pages():
    async def offer():
        peer = VoicePeer(ToneVoice(1), voices=6, videos=4, on_voice=lambda _place, _opus: None)
        try:
            return peer.state, await peer.offer()
        finally:
            await peer.close()

    state, text = asyncio.run(offer())
    tracks = read_offer(text).tracks
    assert state == "new"
    assert [track.kind for track in tracks] == ["audio"] * 7 + ["video"] * 4
    assert [track.is_from_guest for track in tracks] == [True] + [False] * 10


def test_a_voice_comes_at_the_pace_of_speech_until_it_is_stopped():
    async def speak():
        track = ToneTrack(ToneVoice(4))
        await track.recv()
        begin = time.monotonic()
        packets = [await track.recv() for _ in range(60)]
        took = time.monotonic() - begin
        track.stop()
        with pytest.raises(MediaStreamError):
            await track.recv()
        return packets, took

    packets, took = asyncio.run(speak())
    steps = packets[-1].pts - packets[0].pts
    assert steps >= 59 * 960
    assert took > steps / 48000 - 0.5
