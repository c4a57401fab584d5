"""Frames of the pipes between the hub and its process of media: kind, length, bytes."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from io import BufferedIOBase
from typing import Any, cast

from devices.hub.media.voice_wire import Voice

ORDER, VOICE, PICTURE = 1, 2, 3
"""Kinds: an order or a report in JSON; a moment of somebody's voice; a surface's picture."""

MAX_FRAME_BYTES = 1024 * 1024
"""Length of what a frame holds: the largest picture is half of it."""

_HEAD = struct.Struct("<BI")
"""Kind, length."""

_VOICE = struct.Struct("<HHIB")
"""Index of a person, number, time, level."""

_NAME = struct.Struct("<H")
"""Length of a surface's id."""


def pack_order(fields: Mapping[str, Any]) -> bytes:
    """Return an order or a report as a frame."""
    return _frame(ORDER, json.dumps(fields, separators=(",", ":"), allow_nan=False).encode())


def pack_voice(index: int, voice: Voice) -> bytes:
    """Return a moment of somebody's voice as a frame."""
    head = _VOICE.pack(index, voice.seq, voice.time, voice.level_db)
    return _frame(VOICE, head + voice.opus)


def pack_picture(surface_id: str, jpeg: bytes) -> bytes:
    """Return what a surface shows as a frame."""
    name = surface_id.encode()
    return _frame(PICTURE, _NAME.pack(len(name)) + name + jpeg)


def read_order(data: bytes) -> dict[str, Any]:
    """Return the fields of an order or a report."""
    return cast(dict[str, Any], json.loads(data))


def read_voice(data: bytes) -> tuple[int, Voice]:
    """Return whose voice it is, and a moment of it."""
    index, seq, time, level_db = _VOICE.unpack_from(data)
    return index, Voice(seq, time, level_db, data[_VOICE.size :])


def read_picture(data: bytes) -> tuple[str, bytes]:
    """Return a surface's id and what it shows."""
    end = _NAME.size + _NAME.unpack_from(data)[0]
    return data[_NAME.size : end].decode(), data[end:]


def read_frames(pipe: BufferedIOBase) -> Iterator[tuple[int, bytes]]:
    """Yield kind and content of each frame until the pipe ends.

    Raises:
        ValueError: the other side writes something else.
    """
    while len(head := pipe.read(_HEAD.size)) == _HEAD.size:
        kind, length = _HEAD.unpack(head)
        if kind not in (ORDER, VOICE, PICTURE) or length > MAX_FRAME_BYTES:
            raise ValueError(f"media: a frame of kind {kind}, {length} bytes")
        data = pipe.read(length)
        if len(data) < length:
            return
        yield kind, data


def _frame(kind: int, data: bytes) -> bytes:
    if len(data) > MAX_FRAME_BYTES:
        raise ValueError(f"media: {len(data)} bytes, at most {MAX_FRAME_BYTES}")
    return _HEAD.pack(kind, len(data)) + data
