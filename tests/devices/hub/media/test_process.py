"""The process of media with peers that are not ours: voices, silence of the muted, pictures."""

import asyncio
import json

import cv2
import numpy as np
import pytest

pytest.importorskip("aiortc")

from devices.hub.media import frames, process
from devices.hub.media.process import MediaProcess
from sim.headset.voice.peer import VoicePeer
from sim.headset.voice.tone import ToneVoice, decoded

SECONDS = 120.0


class Room:
    """The process's work on this loop, and peers at loopback."""

    def __init__(self):
        self.reports, self.voices, self.peers = [], [], []
        self.media = MediaProcess(self._take)
        self._answers = {}

    def _take(self, data):
        if data[0] == frames.VOICE:
            self.voices.append(frames.read_voice(data[5:]))
            return
        report = json.loads(data[5:])
        self.reports.append(report)
        if report["say"] == "answer":
            self._answers[report["person"]].set_result(report)

    def order(self, **fields):
        self.media.take(frames.ORDER, frames.pack_order(fields)[5:])

    async def ask(self, index, sdp, *, may=True):
        self._answers[index] = asyncio.get_running_loop().create_future()
        self.order(do="offer", person=index, number=1, sdp=sdp, address="127.0.0.1", may=may)
        return await self._answers[index]

    async def join(self, index, voice=None, *, may=True):
        heard, seen = [], []
        peer = VoicePeer(
            voice,
            voices=6,
            videos=4,
            on_voice=lambda place, opus: heard.append((place, opus)),
            seen=lambda place, length: seen.append((place, length)),
        )
        answer = await self.ask(index, await peer.offer(), may=may)
        await peer.accept(answer["sdp"])
        await until(lambda: peer.state == "connected")
        peer.heard, peer.seen = heard, seen
        self.peers.append(peer)
        return peer

    async def end(self):
        for peer in self.peers:
            await peer.close()
        for index in range(10):
            await self.media._close(index)


async def until(wanted):
    async with asyncio.timeout(SECONDS):
        while not wanted():
            await asyncio.sleep(0.02)


def played(scene):
    async def play():
        process._listen_at(["127.0.0.1"])
        room = Room()
        try:
            await scene(room)
        finally:
            await room.end()

    asyncio.run(play())


def tone_of(opus):
    """Loudest frequency of packets, hertz, and their loudness below full scale, dB."""
    samples = decoded(opus)[4800:]
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    hz = 48000 * int(np.argmax(spectrum)) / len(samples)
    return hz, -20 * np.log10(np.sqrt(np.mean(samples**2)) + 1e-9)


def test_a_voice_arrives_at_another_with_its_tone_and_level_and_at_the_hub():
    async def scene(room):
        voice = ToneVoice(3)
        ada = await room.join(1, voice)
        ben = await room.join(2)
        await until(lambda: len(ben.heard) > 45)
        assert ada.heard == [], "nobody hears themselves"
        assert {place for place, _opus in ben.heard} == {0}
        hz, level_db = tone_of([opus for _place, opus in ben.heard[:45]])
        assert abs(hz - voice.tone_hz) < 30
        assert 15 < level_db < 27
        assert {index for index, _voice in room.voices} == {1}
        assert {"say": "places", "voices": [1] + 5 * [None], "videos": 4 * [None]} in room.reports

    played(scene)


def test_the_muted_are_silent_at_the_hub_until_they_may_speak_again():
    async def scene(room):
        await room.join(1, ToneVoice(3), may=False)
        ben = await room.join(2)
        await asyncio.sleep(2.2)
        assert (ben.heard, room.voices) == ([], [])
        room.order(do="speaks", person=1, may=True)
        await until(lambda: len(ben.heard) > 10)
        room.order(do="speaks", person=1, may=False)
        count = -1
        async with asyncio.timeout(SECONDS):
            while len(ben.heard) != count:  # what is on its way still comes
                count = len(ben.heard)
                await asyncio.sleep(1.5)
        await asyncio.sleep(1.5)
        assert len(ben.heard) == count

    played(scene)


def test_a_surface_is_seen_once_encoded_for_all_and_repeats_while_it_rests():
    picture = np.random.default_rng(0).integers(0, 255, (40, 60, 3), np.uint8)
    jpeg = cv2.imencode(".jpg", cv2.resize(picture, (640, 480)))[1].tobytes()

    async def scene(room):
        ada, ben = await room.join(1), await room.join(2)
        keeping = asyncio.ensure_future(room.media.keep_time())
        room.order(do="surfaces", ids=["wall", "desk"])
        room.media.take(frames.PICTURE, frames.pack_picture("desk", jpeg)[5:])
        room.media.take(frames.PICTURE, frames.pack_picture("door", jpeg)[5:])
        await until(lambda: ada.seen and ben.seen)
        assert {place for place, _length in ada.seen} == {1}
        before = len(ada.seen)
        await until(lambda: len(ada.seen) > before)
        room.order(do="surfaces", ids=["wall"])
        assert room.reports[-1]["videos"] == ["wall", None, None, None]
        keeping.cancel()

    played(scene)


def test_hostile_offers_are_answered_with_a_reason(chromium_offer):
    text = chromium_offer()

    async def scene(room):
        random = np.random.default_rng(2)
        offers = ["", "v=0", text[:900], text.replace("sha-256 AB", "sha-256 A"), "x" * 50_000]
        for _ in range(40):
            data = bytearray(text.encode())
            for place in random.integers(0, len(data), 6):
                data[place] = int(random.integers(32, 127))
            offers.append(data.decode())
        for sdp in offers:
            answer = await room.ask(3, sdp)
            assert "sdp" in answer or answer["why"]
        ben = await room.join(2)
        assert ben.state == "connected", "others are not disturbed"

    played(scene)
