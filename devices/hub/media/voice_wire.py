"""A moment of somebody's voice in bytes: Opus, as WebRTC and the WebSocket both carry it."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from devices.hub.protocol.wire import VERSION, WireError

VOICE_KIND, VOICES_KIND = 5, 6
"""Second byte: one moment on its way to the hub; several, from it."""

RATE_HZ = 48_000
"""Clock of Opus, whatever it was recorded at."""

MAX_OPUS_BYTES = 480
"""Length of a moment; chosen: 60 ms at 64 kbit/s, twice what the page asks for."""

MAX_MOMENT = 2880
"""Samples of a moment: 60 ms, the longest that one Opus frame lasts."""

SILENT_DB = 127
"""Level below full scale that means silence, and the largest there is."""

_HEADER = struct.Struct("<BBHIB")
"""Version, kind, number, time in samples, level."""

_BUNDLE_HEADER = struct.Struct("<BBH")
"""Version, kind, number of moments."""

_ITEM = struct.Struct("<HHHIB")
"""Index of a person, length of what follows; number, time, level, then the Opus."""

_ITEM_HEAD = 4
"""Bytes of index and length."""

MIN_VOICE_BYTES, MAX_VOICE_BYTES = _HEADER.size + 1, _HEADER.size + MAX_OPUS_BYTES
"""Lengths of one moment with its header."""

_SILK, _HYBRID, _CELT = (480, 960, 1920, 2880), (480, 960), (120, 240, 480, 960)
"""Samples of a frame by the configuration in the first byte of Opus (RFC 6716, 3.1)."""


@dataclass(frozen=True, slots=True)
class Voice:
    """A moment of voice.

    Attributes:
        seq: counts a person's moments, of 16 bits.
        time: samples of 48 kHz since some instant of the speaker's, of 32 bits.
        level_db: how far below full scale it is, 0..127 dB; 127 is silence.
        opus: one packet.
    """

    seq: int
    time: int
    level_db: int
    opus: bytes


def encode_voice(voice: Voice) -> bytes:
    """Return a moment as it goes to the hub.

    Layout: `u8 version, u8 kind = 5, u16 seq, u32 time, u8 level`, the Opus packet to the end.

    Raises:
        WireError: it is too long, or a number does not fit.
    """
    try:
        head = _HEADER.pack(VERSION, VOICE_KIND, voice.seq, voice.time, voice.level_db)
    except struct.error as error:
        raise WireError(f"voice {voice.seq}: {error}") from error
    data = head + voice.opus
    decode_voice(data)
    return data


def decode_voice(data: bytes) -> Voice:
    """Return the moment in bytes of somebody else.

    Raises:
        WireError: it is cut short, too long, of another version, or no Opus of at most 60 ms.
    """
    if not MIN_VOICE_BYTES <= len(data) <= MAX_VOICE_BYTES:
        raise WireError(f"voice: {len(data)} bytes, wanted {MIN_VOICE_BYTES} to {MAX_VOICE_BYTES}")
    version, kind, seq, time, level_db = _HEADER.unpack_from(data)
    if (version, kind) != (VERSION, VOICE_KIND):
        raise WireError(f"voice: version {version}, kind {kind}; wanted {VERSION}, {VOICE_KIND}")
    if level_db > SILENT_DB:
        raise WireError(f"voice {seq}: level {level_db}, wanted at most {SILENT_DB}")
    opus = data[_HEADER.size :]
    opus_samples(opus)
    return Voice(seq, time, level_db, opus)


def opus_samples(opus: bytes) -> int:
    """Return how long a packet of Opus lasts, samples of 48 kHz.

    Raises:
        WireError: it is none, or lasts over 60 ms.
    """
    if not 1 <= len(opus) <= MAX_OPUS_BYTES:
        raise WireError(f"Opus: {len(opus)} bytes, wanted 1 to {MAX_OPUS_BYTES}")
    config, code = opus[0] >> 3, opus[0] & 3
    table = _SILK if config < 12 else _HYBRID if config < 16 else _CELT
    frames = 1 if code == 0 else 2
    if code == 3:
        if len(opus) < 2:
            raise WireError("Opus: a packet of several frames without their number")
        frames = opus[1] & 63
    samples = frames * table[config % len(table)]
    if not 0 < samples <= MAX_MOMENT:
        raise WireError(f"Opus: {samples} samples, wanted 1 to {MAX_MOMENT}")
    return samples


def pack_voices(voices: Sequence[tuple[int, Voice]]) -> bytes:
    """Return moments of several people as one message from the hub.

    Layout: `u8 version, u8 kind = 6, u16 count`, then of each `u16 person, u16 length`, and of that
    length `u16 seq, u32 time, u8 level` and the Opus packet.

    Args:
        voices: index of a person, and their voice.
    """
    parts = [_BUNDLE_HEADER.pack(VERSION, VOICES_KIND, len(voices))]
    for index, voice in voices:
        length = _ITEM.size - _ITEM_HEAD + len(voice.opus)
        parts.append(_ITEM.pack(index, length, voice.seq, voice.time, voice.level_db) + voice.opus)
    return b"".join(parts)


def unpack_voices(data: bytes) -> tuple[tuple[int, Voice], ...]:
    """Return indices of people and their voices.

    Raises:
        WireError: it is cut short, too long or of another version or kind.
    """
    if len(data) < _BUNDLE_HEADER.size:
        raise WireError(f"voices: {len(data)} bytes, wanted at least {_BUNDLE_HEADER.size}")
    version, kind, count = _BUNDLE_HEADER.unpack_from(data)
    if (version, kind) != (VERSION, VOICES_KIND):
        raise WireError(f"voices: version {version}, kind {kind}; wanted {VERSION}, {VOICES_KIND}")
    found: list[tuple[int, Voice]] = []
    at = _BUNDLE_HEADER.size
    for number in range(count):
        if len(data) - at < _ITEM.size:
            raise WireError(f"voices: ends in the head of number {number} of {count}")
        index, length, seq, time, level_db = _ITEM.unpack_from(data, at)
        begin, at = at + _ITEM.size, at + _ITEM_HEAD + length
        if not begin < at <= min(begin + MAX_OPUS_BYTES, len(data)):
            raise WireError(f"voices: number {number} of {length} bytes does not fit")
        found.append((index, Voice(seq, time, level_db, data[begin:at])))
    if at != len(data):
        raise WireError(f"voices: {len(data)} bytes, wanted {at}")
    return tuple(found)
