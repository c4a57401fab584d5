"""A simulated voice: a tone as Opus, a second long, then a second of silence, and again."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any, cast

import av
import numpy as np
from numpy.typing import NDArray

from devices.hub.media.voice_wire import RATE_HZ, Voice

MOMENT = 960
"""Samples of a moment: 20 ms, as of browsers."""

MOMENT_S = MOMENT / RATE_HZ
"""The same in seconds."""

SPOKEN, SILENT = 50, 50
"""Moments of the tone, and of the silence after it: longer than a pause within which somebody
keeps their place."""

MIN_HZ, MAX_HZ = 200.0, 900.0
"""Tones of the voices: where speech is loudest."""

LEVEL_DB = 20
"""Loudness of the tone, dB below full scale: as a browser makes speech."""

BIT_RATE = 32_000
"""Of Opus, as the page's."""


class ToneVoice:
    """One person's voice.

    Args:
        seed: decides the tone and when it begins.
    """

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.tone_hz = round(float(random.uniform(MIN_HZ, MAX_HZ)))
        self._begin = int(random.integers(SPOKEN + SILENT))
        self._moments = spoken_tone(self.tone_hz)

    def moment(self, number: int, time: int) -> Voice | None:
        """Return a moment; None in a pause.

        Args:
            number: since the beginning.
            time: of the device's clock, samples of 48 kHz.
        """
        place = (number + self._begin) % (SPOKEN + SILENT)
        if place >= SPOKEN:
            return None
        return Voice(number & 0xFFFF, time & 0xFFFFFFFF, LEVEL_DB, self._moments[place])


@cache
def spoken_tone(tone_hz: float) -> tuple[bytes, ...]:
    """Return a second of a tone, one packet of Opus a moment."""
    codec = cast(Any, av.CodecContext.create("libopus", "w"))
    codec.bit_rate, codec.format, codec.layout = BIT_RATE, "s16", "mono"
    codec.sample_rate, codec.time_base = RATE_HZ, Fraction(1, RATE_HZ)
    codec.options = {"application": "voip"}
    times = np.arange((SPOKEN + 1) * MOMENT) / RATE_HZ
    loud = 2**0.5 * 10 ** (-LEVEL_DB / 20)
    samples = np.rint(32767 * loud * np.sin(2 * np.pi * tone_hz * times)).astype(np.int16)
    packets: list[bytes] = []
    for number in range(SPOKEN + 1):
        part = samples[number * MOMENT : (number + 1) * MOMENT].reshape(1, -1)
        frame = av.AudioFrame.from_ndarray(part, format="s16", layout="mono")
        frame.sample_rate, frame.pts = RATE_HZ, number * MOMENT
        packets += [bytes(packet) for packet in codec.encode(frame)]
    packets += [bytes(packet) for packet in codec.encode(None)]
    return tuple(packets[:SPOKEN])


def decoded(packets: list[bytes]) -> NDArray[np.float64]:
    """Return samples of packets in their order, -1..1."""
    codec = cast(Any, av.CodecContext.create("libopus", "r"))
    codec.format, codec.layout, codec.sample_rate = "s16", "mono", RATE_HZ
    parts: list[NDArray[np.float64]] = []
    for packet in packets:
        for frame in codec.decode(av.Packet(packet)):
            values = np.asarray(frame.to_ndarray(), dtype=np.float64).reshape(-1)
            channels = len(frame.layout.channels)
            parts.append(values.reshape(-1, channels).mean(axis=1) / 32768.0)
    return np.concatenate(parts) if parts else np.zeros(0)
