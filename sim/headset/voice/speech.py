"""Speaking and hearing of a simulated person, over the WebSocket or by WebRTC."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from devices.hub.media.voice_wire import RATE_HZ, VOICES_KIND, encode_voice, unpack_voices
from devices.hub.protocol.wire import WireError
from sim.headset.connection import HubConnection
from sim.headset.tally import Tally

if TYPE_CHECKING:  # who does not speak needs no codec
    from sim.headset.voice.peer import VoicePeer
    from sim.headset.voice.tone import ToneVoice

MAX_TIME = 0x1_0000_0000
"""Times of voices begin anew after so many samples: a day."""

MOMENT_S = 0.02
"""Time between two moments of a voice, seconds: as of browsers."""

LOOK_S = 0.1
"""Time between looks at a connection of WebRTC."""


@dataclass(frozen=True, slots=True)
class Speech:
    """Speakers of a crowd.

    Attributes:
        speakers: the first so many.
        is_rtc: whether voices come and go by WebRTC.
        is_on: whether anybody listens or speaks at all.
        speaks: whether this one does.
    """

    speakers: int = 0
    is_rtc: bool = False
    speaks: bool = False

    @property
    def is_on(self) -> bool:
        """Whether anybody speaks: then all listen."""
        return self.speakers > 0

    def of(self, number: int) -> Speech:
        """Return the same as it is for one of them."""
        return Speech(self.speakers, self.is_rtc, number < self.speakers)


NO_SPEECH = Speech()
"""Nobody speaks, nobody listens."""


class Speaking:
    """One person's voice and ears while a connection lasts.

    Args:
        connection: to the hub.
        speech: what is wanted.
        seed: of the voice.
        tally: takes the figures.
    """

    def __init__(
        self, connection: HubConnection, speech: Speech, *, seed: int, tally: Tally
    ) -> None:
        self._connection, self._speech, self._tally = connection, speech, tally
        self._voice = _voice_of(seed) if speech.speaks else None
        self._peer: VoicePeer | None = None

    @property
    def is_connected(self) -> bool:
        """Whether WebRTC is."""
        return self._peer is not None and self._peer.state == "connected"

    async def go_on(self, is_there: Callable[[], bool]) -> None:
        """Speak at the pace of speech, until it is cancelled.

        Args:
            is_there: whether the headset is on and nothing is cut.
        """
        await self._tell("socket")
        if self._speech.is_rtc:
            await self._offer()
            while not self.is_connected:
                await asyncio.sleep(LOOK_S)
            await self._tell("rtc")
        if self._voice is None or self._peer is not None:
            while True:
                await asyncio.sleep(1.0)
                if self._peer is not None and self._peer.track is not None:
                    self._tally.spoken += self._peer.track.sent
                    self._peer.track.sent = 0
        number, due_s = 0, time.perf_counter()
        while True:
            due_s = max(due_s + MOMENT_S, time.perf_counter() - 1.0)
            await asyncio.sleep(max(0.0, due_s - time.perf_counter()))
            number += 1
            moment = self._voice.moment(number, _now())
            if moment is not None and is_there():
                await self._connection.send_bytes(encode_voice(moment))
                self._tally.spoken += 1

    def take_voices(self, data: bytes) -> bool:
        """Take a message if it is voices; return whether it is."""
        if data[1:2] != bytes([VOICES_KIND]):
            return False
        try:
            voices = unpack_voices(data)
        except WireError:
            self._tally.unreadable += 1
            return True
        for index, voice in voices:
            self._tally.heard += 1
            if index in self._tally.indices and not self._speech.is_rtc:
                self._tally.voice.add(1000.0 * ((_now() - voice.time) % MAX_TIME) / RATE_HZ)
        return True

    async def take_answer(self, said: dict[str, Any]) -> None:
        """Take the hub's answer to the offer."""
        if self._peer is not None and "sdp" in said:
            await self._peer.accept(str(said["sdp"]))
        elif self._peer is not None:
            self._tally.failures.append(f"WebRTC: {said.get('why', 'no answer')}")

    async def close(self) -> None:
        """End WebRTC, where there is any."""
        if self._peer is not None:
            await self._peer.close()

    async def _tell(self, way: str) -> None:
        has = self._voice is not None
        said = {"kind": "media", "voice": way, "microphone": has, "videos": list[str]()}
        await self._connection.send(said)

    async def _offer(self) -> None:
        from sim.headset.voice.peer import VoicePeer  # the extra `people-media`

        media: dict[str, Any] = self._connection.welcome["media"]
        self._peer = VoicePeer(
            self._voice,
            voices=int(media["voices"]),
            videos=int(media["videos"]),
            on_voice=self._hear,
        )
        await self._connection.send({"kind": "offer", "sdp": await self._peer.offer()})

    def _hear(self, place: int, opus: bytes) -> None:
        del place, opus
        self._tally.heard += 1


def _now() -> int:
    """Return the time of this process's clock, samples of 48 kHz."""
    return (time.perf_counter_ns() * RATE_HZ // 10**9) % MAX_TIME


def _voice_of(seed: int) -> ToneVoice:
    from sim.headset.voice.tone import ToneVoice

    return ToneVoice(seed)
