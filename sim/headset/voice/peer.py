"""A simulated headset's WebRTC: its voice to the hub, others' voices and surfaces from it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from fractions import Fraction
from typing import Any, cast

import av
from aiortc import (
    RTCBundlePolicy,
    RTCConfiguration,
    RTCPeerConnection,
    RTCSessionDescription,
)
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from devices.hub.media.voice_wire import RATE_HZ
from sim.headset.voice.tone import MOMENT, MOMENT_S, ToneVoice

BUNDLED = RTCConfiguration(iceServers=[], bundlePolicy=RTCBundlePolicy.MAX_BUNDLE)
"""One port for all tracks, and no server that would see addresses."""

TIME_BASE = Fraction(1, RATE_HZ)
"""Seconds of a sample."""


class ToneTrack(MediaStreamTrack):
    """A voice as the packets that it consists of.

    Args:
        voice: whose.
    """

    kind = "audio"

    def __init__(self, voice: ToneVoice) -> None:
        super().__init__()
        self._voice = voice
        self._number = 0
        self._due_s: float | None = None
        self.sent = 0

    async def recv(self) -> Any:
        """Return the next packet at its time.

        Raises:
            MediaStreamError: it has ended.
        """
        loop = asyncio.get_running_loop()
        while self.readyState == "live":
            due_s = loop.time() if self._due_s is None else self._due_s + MOMENT_S
            await asyncio.sleep(max(0.0, due_s - loop.time()))
            self._due_s = max(due_s, loop.time() - 1.0)
            self._number += 1
            moment = self._voice.moment(self._number, self._number * MOMENT)
            if moment is not None:
                packet = av.Packet(moment.opus)
                packet.pts, packet.time_base = self._number * MOMENT, TIME_BASE
                self.sent += 1
                return packet
        raise MediaStreamError


class VoicePeer:
    """One person's connection, as the page has it.

    Args:
        voice: theirs; None for somebody who listens.
        voices: places of others' voices.
        videos: places of surfaces.
        on_voice: takes the place and the Opus of each moment that comes.
        seen: takes the place and the length of each packet of a video that comes.
    """

    def __init__(
        self,
        voice: ToneVoice | None,
        *,
        voices: int,
        videos: int,
        on_voice: Callable[[int, bytes], None],
        seen: Callable[[int, int], None] = lambda _place, _length: None,
    ) -> None:
        self._connection = RTCPeerConnection(BUNDLED)
        self.track = None if voice is None else ToneTrack(voice)
        self._connection.addTransceiver(self.track or "audio", direction="sendonly")
        for place in range(voices):
            self._listen("audio", lambda data, at=place: on_voice(at, data))
        for place in range(videos):
            self._listen("video", lambda data, at=place: seen(at, len(data)))

    @property
    def state(self) -> str:
        """Of the connection, as WebRTC calls it."""
        return str(self._connection.connectionState)

    async def offer(self) -> str:
        """Return an offer."""
        await self._connection.setLocalDescription(await self._connection.createOffer())
        return str(self._connection.localDescription.sdp)

    async def accept(self, sdp: str) -> None:
        """Take the hub's answer."""
        await self._connection.setRemoteDescription(RTCSessionDescription(sdp, "answer"))

    async def close(self) -> None:
        """End it."""
        await self._connection.close()

    def _listen(self, kind: str, took: Callable[[bytes], None]) -> None:
        line = self._connection.addTransceiver(kind, direction="recvonly")

        async def take(packet: Any, arrival_time_ms: int) -> None:
            del arrival_time_ms
            took(bytes(packet.payload))

        # Decoding many voices would take the processor from the hub that is measured.
        cast(Any, line.receiver)._handle_rtp_packet = take
