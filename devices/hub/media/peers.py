"""One person's connection by WebRTC: their microphone in, voices and surfaces out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Protocol, cast

from aiortc import (
    RTCBundlePolicy,
    RTCConfiguration,
    RTCPeerConnection,
    RTCSessionDescription,
)
from aiortc.rtcrtptransceiver import RTCRtpTransceiver

from devices.hub.media.floor import PLACES
from devices.hub.media.offer import Offer, asking_for_speech, clean_offer, read_offer
from devices.hub.media.signals import VIDEOS
from devices.hub.media.tracks import VideoTrack, VoiceTrack
from devices.hub.media.voice_wire import SILENT_DB, Voice, opus_samples
from devices.hub.protocol.wire import WireError

BUNDLED = RTCConfiguration(iceServers=[], bundlePolicy=RTCBundlePolicy.MAX_BUNDLE)
"""One port for all tracks, and no server that would see addresses."""

ANSWER_S = 5.0
"""Longest time to make an answer; chosen: addresses of this machine alone are looked up."""

CLOSE_S = 2.0
"""Longest time to close a connection."""

UNKNOWN_DB = 20
"""Level of a voice whose browser does not say how loud it is: as of somebody who speaks."""


class Packet(Protocol):
    """Part of a packet of RTP that is used."""

    sequence_number: int
    timestamp: int
    payload: bytes
    extensions: Any


class Peer:
    """A connection, from an offer to its end; on the loop's thread.

    Args:
        index: of the person.
        on_voice: takes each moment of their voice.
        wants_whole: takes the number of a video of which a whole picture is wanted.
        changed: takes the connection's state, as WebRTC calls it.
    """

    def __init__(
        self,
        index: int,
        *,
        on_voice: Callable[[int, Voice], None],
        wants_whole: Callable[[int], None],
        changed: Callable[[str], None],
    ) -> None:
        self.index = index
        self.voices = [VoiceTrack() for _ in range(PLACES)]
        self.videos = [VideoTrack() for _ in range(VIDEOS)]
        self._on_voice, self._wants_whole, self._changed = on_voice, wants_whole, changed
        self._connection = RTCPeerConnection(BUNDLED)
        self._connection.on("connectionstatechange", self._say_state)

    @property
    def is_connected(self) -> bool:
        """Whether packets go through."""
        return self._connection.connectionState == "connected"

    async def answer(self, sdp: str, address: str) -> str:
        """Return our answer to an offer.

        Raises:
            OfferError: it cannot be answered.
            TimeoutError: it takes too long.
        """
        offer = read_offer(sdp)
        text = clean_offer(offer, address)
        async with asyncio.timeout(ANSWER_S):
            await self._connection.setRemoteDescription(RTCSessionDescription(text, "offer"))
            self._lay_tracks(offer)
            await self._connection.setLocalDescription(await self._connection.createAnswer())
        return asking_for_speech(self._connection.localDescription.sdp)

    async def close(self) -> None:
        """End it."""
        for track in (*self.voices, *self.videos):
            track.stop()
        async with asyncio.timeout(CLOSE_S):
            await self._connection.close()

    def _lay_tracks(self, offer: Offer) -> None:
        """Give the browser's tracks what is to go over them, in their order."""
        voices, videos = iter(self.voices), enumerate(self.videos)
        has_microphone = False
        for asked, line in zip(offer.tracks, self._connection.getTransceivers(), strict=True):
            if line.kind == "audio" and not has_microphone and asked.is_from_guest:
                has_microphone = True
                line.direction = "recvonly"
                # The library would decode each voice, for which nobody here listens.
                cast(Any, line.receiver)._handle_rtp_packet = self._take_packet
            elif line.kind == "audio":
                self._lay(line, next(voices, None))
            else:
                number, track = next(videos, (-1, None))
                self._lay(line, track)
                cast(Any, line.sender)._send_keyframe = lambda at=number: self._wants_whole(at)

    def _lay(self, line: RTCRtpTransceiver, track: VoiceTrack | VideoTrack | None) -> None:
        if track is None:
            line.direction = "inactive"
        else:
            line.sender.replaceTrack(track)
            line.direction = "sendonly"

    async def _take_packet(self, packet: Packet, arrival_time_ms: int) -> None:
        """Hand a packet of the microphone on as it is."""
        del arrival_time_ms
        level = packet.extensions.audio_level
        level_db = UNKNOWN_DB if level is None else min(int(level[1]), SILENT_DB)
        try:
            opus_samples(packet.payload)
        except WireError:
            return
        voice = Voice(
            packet.sequence_number & 0xFFFF,
            packet.timestamp & 0xFFFFFFFF,
            level_db,
            packet.payload,
        )
        self._on_voice(self.index, voice)

    def _say_state(self) -> None:
        self._changed(str(self._connection.connectionState))
