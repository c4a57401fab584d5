"""Units on the socket between the process that reads a camera and the studio, lengths checked.

A message is a byte that says what, four bytes of length, and that many bytes. The reading process
is trusted no further than its length: what a hostile stream makes of it costs one message.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from devices.camera.units import StreamFormat, Unit

OPENED, FORMAT, UNIT, FAILED = 1, 2, 3, 4
"""Kinds of messages."""

MAX_BYTES = 64 << 20
"""Longest message, bytes: a raw picture of 7680×3840 px with two bytes a pixel is 59 MB."""

_HEAD = struct.Struct("<BI")
_UNIT = struct.Struct("<BBq")
_FAILED = struct.Struct("<B")
_SIZE = struct.Struct("<II")
_NO_TIME = -(1 << 63)


class LineError(ValueError):
    """Bytes that are no such message."""


@dataclass(frozen=True, slots=True)
class Opened:
    """The stream is open; units follow."""


@dataclass(frozen=True, slots=True)
class Failed:
    """Nothing more will come.

    Attributes:
        text: why, and what to do.
        is_final: whether trying again by itself is of no use.
    """

    text: str
    is_final: bool


def encode_opened() -> bytes:
    """The stream is open."""
    return _HEAD.pack(OPENED, 0)


def encode_format(form: StreamFormat) -> bytes:
    """How the units after it are coded."""
    words = f"{form.codec}\n{form.pixels}\n".encode()
    body = _SIZE.pack(form.width_px, form.height_px) + words + form.header
    return _HEAD.pack(FORMAT, len(body)) + body


def encode_unit(unit: Unit) -> bytes:
    """One unit, of the format that was sent last.

    Raises:
        LineError: it is longer than `MAX_BYTES`.
    """
    size = _UNIT.size + len(unit.data)
    if size > MAX_BYTES:
        raise LineError(f"encoded picture of {len(unit.data)} bytes, at most {MAX_BYTES}")
    pts_ns = _NO_TIME if unit.pts_ns is None else unit.pts_ns
    return _HEAD.pack(UNIT, size) + _UNIT.pack(unit.keyframe, unit.track, pts_ns) + unit.data


def encode_failed(failed: Failed) -> bytes:
    """Why nothing more will come."""
    text = failed.text.encode()[:4096]
    return _HEAD.pack(FAILED, len(text) + 1) + _FAILED.pack(failed.is_final) + text


class LineReader:
    """Bytes in, messages out; holds at most one message that is not whole."""

    def __init__(self) -> None:
        self._held = bytearray()
        self._form: StreamFormat | None = None

    def take(self, data: bytes) -> list[Opened | Unit | Failed]:
        """The messages that are whole now.

        Raises:
            LineError: the bytes are none.
        """
        self._held += data
        messages: list[Opened | Unit | Failed] = []
        at = 0
        while len(self._held) - at >= _HEAD.size:
            kind, size = _HEAD.unpack_from(self._held, at)
            if size > MAX_BYTES:
                raise LineError(f"message of {size} bytes, at most {MAX_BYTES}")
            end = at + _HEAD.size + size
            if len(self._held) < end:
                break
            message = self._message(kind, bytes(self._held[at + _HEAD.size : end]))
            if message is not None:
                messages.append(message)
            at = end
        del self._held[:at]
        return messages

    def _message(self, kind: int, body: bytes) -> Opened | Unit | Failed | None:
        try:
            if kind == OPENED:
                return Opened()
            if kind == FORMAT:
                self._form = _format(body)
                return None
            if kind == UNIT:
                return self._unit(body)
            if kind == FAILED:
                (is_final,) = _FAILED.unpack_from(body)
                return Failed(body[1:].decode(errors="replace"), bool(is_final))
        except (struct.error, UnicodeDecodeError) as error:
            raise LineError(f"message {kind} of {len(body)} bytes: {error}") from None
        raise LineError(f"message {kind}: not known")

    def _unit(self, body: bytes) -> Unit:
        keyframe, track, pts_ns = _UNIT.unpack_from(body)
        if self._form is None:
            raise LineError("a unit before its format")
        return Unit(
            self._form,
            body[_UNIT.size :],
            bool(keyframe),
            None if pts_ns == _NO_TIME else pts_ns,
            track,
        )


def _format(body: bytes) -> StreamFormat:
    width_px, height_px = _SIZE.unpack_from(body)
    codec, mark, rest = body[_SIZE.size :].partition(b"\n")
    pixels, second, header = rest.partition(b"\n")
    if not (mark and second):
        raise LineError("a format without its words")
    return StreamFormat(codec.decode(), header, width_px, height_px, pixels.decode())
