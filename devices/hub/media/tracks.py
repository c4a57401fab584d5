"""Voices and pictures on their way out: encoded already, the same for everybody."""

from __future__ import annotations

import asyncio
from fractions import Fraction
from typing import Any

from aiortc.mediastreams import MediaStreamError, MediaStreamTrack
from av import Packet

from devices.hub.media.voice_wire import RATE_HZ, Voice, opus_samples

VOICE_BASE, VIDEO_BASE = Fraction(1, RATE_HZ), Fraction(1, 90_000)
"""Seconds of a step of the timestamps."""

MAX_VOICES = 10
"""Moments of a voice that wait: 200 ms; of more, the oldest goes."""

MAX_PICTURES = 30
"""Pictures that wait; more and all go until the next whole one: each needs the one before."""

GAP = 5 * RATE_HZ
"""Samples that a speaker's time may jump; more and it is another speaker's or device's."""


Encoded = Any
"""A packet as the library takes it; its type is generic in stubs alone."""


class OutgoingTrack(MediaStreamTrack):
    """Packets that wait for one connection.

    Args:
        kind: "audio" or "video".
        limit: packets that wait.
    """

    def __init__(self, kind: str, limit: int) -> None:
        super().__init__()
        self.kind = kind
        self._packets: asyncio.Queue[Encoded | None] = asyncio.Queue(limit + 1)

    async def recv(self) -> Encoded:
        """Return the next packet.

        Raises:
            MediaStreamError: it has ended.
        """
        packet = None if self.readyState != "live" else await self._packets.get()
        if packet is None:
            raise MediaStreamError
        return packet

    def stop(self) -> None:
        """End it."""
        super().stop()
        self._clear()
        self._packets.put_nowait(None)

    def _clear(self) -> None:
        while not self._packets.empty():
            self._packets.get_nowait()

    def _put(self, data: bytes, *, pts: int, base: Fraction) -> None:
        packet: Encoded = Packet(data)
        packet.pts, packet.time_base = pts, base
        self._packets.put_nowait(packet)


class VoiceTrack(OutgoingTrack):
    """A place of the floor on its way to one listener; its time goes on, whoever speaks."""

    def __init__(self) -> None:
        super().__init__("audio", MAX_VOICES)
        self._speaker: int | None = None
        self._spoken = 0
        self._pts = 0

    def put(self, index: int, voice: Voice) -> None:
        """Take somebody's moment; the oldest goes where too many wait."""
        if self.readyState != "live":
            return
        ahead = (voice.time - self._spoken) & 0xFFFFFFFF
        if self._speaker != index or ahead > GAP:
            ahead = opus_samples(voice.opus)
        self._speaker, self._spoken = index, voice.time
        self._pts += ahead
        if self._packets.qsize() >= MAX_VOICES:
            self._packets.get_nowait()
        self._put(voice.opus, pts=self._pts, base=VOICE_BASE)


class VideoTrack(OutgoingTrack):
    """A surface's pictures on their way to one viewer."""

    def __init__(self) -> None:
        super().__init__("video", MAX_PICTURES)
        self._needs_whole = True

    def put(self, data: bytes, pts: int, *, is_whole: bool) -> None:
        """Take an encoded picture; where too many wait, all go until the next whole one."""
        if self.readyState != "live":
            return
        if self._packets.qsize() >= MAX_PICTURES:
            self._clear()
            self._needs_whole = True
        if is_whole:
            self._needs_whole = False
        if not self._needs_whole:
            self._put(data, pts=pts, base=VIDEO_BASE)

    def begin(self) -> None:
        """Wait for a whole picture: another surface is shown from here on."""
        self._clear()
        self._needs_whole = True
