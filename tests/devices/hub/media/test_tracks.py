"""Voices and pictures on their way out: time goes on, the oldest goes, whole pictures first."""

import asyncio
from itertools import pairwise

import pytest

pytest.importorskip("aiortc")

from aiortc.mediastreams import MediaStreamError

from devices.hub.media.tracks import MAX_PICTURES, MAX_VOICES, VideoTrack, VoiceTrack
from devices.hub.media.voice_wire import Voice

OPUS = bytes([0b01111_0_00]) + bytes(40)


def test_time_goes_on_over_pauses_and_speakers():
    async def times():
        track = VoiceTrack()
        for index, moment in [(1, 1000), (1, 1960), (1, 49960), (2, 5), (2, 965), (1, 7)]:
            track.put(index, Voice(0, moment, 20, OPUS))
        return [(await track.recv()).pts for _ in range(6)]

    at = asyncio.run(times())
    assert [b - a for a, b in pairwise(at)] == [960, 48000, 960, 960, 960]


def test_of_too_many_moments_the_oldest_goes():
    async def kept():
        track = VoiceTrack()
        for number in range(3 * MAX_VOICES):
            track.put(1, Voice(number, 960 * number, 20, bytes([OPUS[0], number])))
        return [bytes(await track.recv())[1] for _ in range(MAX_VOICES)]

    assert asyncio.run(kept()) == list(range(2 * MAX_VOICES, 3 * MAX_VOICES))


def test_pictures_begin_with_a_whole_one_and_do_so_again_after_too_many():
    async def seen():
        track = VideoTrack()
        track.put(b"part", 1, is_whole=False)
        track.put(b"whole", 2, is_whole=True)
        track.put(b"part", 3, is_whole=False)
        first = [bytes(await track.recv()), bytes(await track.recv())]
        for number in range(MAX_PICTURES + 5):
            track.put(b"part", number, is_whole=False)
        track.put(b"whole", 99, is_whole=True)
        return first, (await track.recv()).pts

    assert asyncio.run(seen()) == ([b"whole", b"part"], 99)


def test_one_that_has_ended_gives_and_takes_nothing():
    async def end():
        track = VoiceTrack()
        waiting = asyncio.ensure_future(track.recv())
        await asyncio.sleep(0)
        track.stop()
        track.put(1, Voice(0, 0, 20, OPUS))
        with pytest.raises(MediaStreamError):
            await waiting
        with pytest.raises(MediaStreamError):
            await track.recv()

    asyncio.run(end())
