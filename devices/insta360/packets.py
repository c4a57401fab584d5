"""Packets of the camera's TCP port 6666: bytes to packets and back, without a socket.

Each packet is `u32 length` (its own four bytes included), `u8 kind`, two zero bytes, and the rest.
All numbers are little-endian. The parser takes the stream in pieces of any size.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from devices.insta360.errors import CameraProtocolError

PORT = 6666
"""Port that cameras listen on."""

MAX_PACKET_BYTES = 4 << 20
"""Limit of one packet. A keyframe of 2880×1440 px at 40 Mbit/s is about 0.5 MB."""

SYNC_WORDS = b"syNceNdinS"
"""First words of both sides."""

_STREAM, _MESSAGE, _KEEP_ALIVE, _SYNC = 1, 4, 5, 6
_HEAD = struct.Struct("<IB2x")
_MESSAGE_HEAD = struct.Struct("<HB3s3s")
_STREAM_HEAD = struct.Struct("<BQ")
_PROTOBUF = 2
_FLAGS = b"\x80\x00\x00"

VIDEO, GYRO, CLOCK = 0x20, 0x30, 0x40
"""Channels of stream packets: Annex B video, IMU samples (56 bytes, as in files), time stamps."""


@dataclass(frozen=True, slots=True)
class Sync:
    """The handshake; the camera sends it back as it is."""


@dataclass(frozen=True, slots=True)
class KeepAlive:
    """Nothing to say, but still here."""


@dataclass(frozen=True, slots=True)
class Message:
    """A command (client to camera), its reply, or a notification (camera to client).

    Attributes:
        code: which command, 200 or an error, or which notification (8192 and above).
        seq: of the command, 24 bits; a reply has its command's.
        body: protocol buffers; of an error, plain text on some cameras.
    """

    code: int
    seq: int
    body: bytes = b""


@dataclass(frozen=True, slots=True)
class Stream:
    """A piece of a live stream.

    Attributes:
        channel: `VIDEO`, `GYRO`, `CLOCK`, or one that is not known.
        stamp: time on the camera's clock, milliseconds or microseconds (`camera_time.py`).
        data: the piece.
    """

    channel: int
    stamp: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Unknown:
    """A packet of a kind that is not known; it is skipped."""

    kind: int
    data: bytes


Packet = Sync | KeepAlive | Message | Stream | Unknown


def encode(packet: Packet) -> bytes:
    """The packet as it is on the wire, length included.

    Raises:
        CameraProtocolError: it would be longer than `MAX_PACKET_BYTES`.
    """
    kind, rest = _parts(packet)
    size = _HEAD.size + len(rest)
    if size > MAX_PACKET_BYTES:
        raise CameraProtocolError(f"packet of {size} bytes, at most {MAX_PACKET_BYTES}")
    return _HEAD.pack(size, kind) + rest


def _parts(packet: Packet) -> tuple[int, bytes]:
    match packet:
        case Sync():
            return _SYNC, SYNC_WORDS
        case KeepAlive():
            return _KEEP_ALIVE, b""
        case Message(code, seq, body):
            seq_bytes = (seq & 0xFFFFFF).to_bytes(3, "little")
            return _MESSAGE, _MESSAGE_HEAD.pack(code, _PROTOBUF, seq_bytes, _FLAGS) + body
        case Stream(channel, stamp, data):
            return _STREAM, _STREAM_HEAD.pack(channel, stamp) + data
        case Unknown(kind, data):
            return kind, data


class PacketParser:
    """Bytes in, whole packets out; holds at most one packet that is not whole yet."""

    def __init__(self) -> None:
        self._held = bytearray()

    @property
    def held_bytes(self) -> int:
        """Bytes of a packet whose rest is missing; never `MAX_PACKET_BYTES` or more."""
        return len(self._held)

    def feed(self, data: bytes) -> list[Packet]:
        """The packets that these bytes complete, in order.

        Raises:
            CameraProtocolError: a length that no packet has, or a packet that is shorter than what
                its kind needs. The stream has lost its rhythm then: connect anew.
        """
        held = self._held
        held += data
        packets: list[Packet] = []
        at = 0
        while len(held) - at >= 4:
            size = int.from_bytes(held[at : at + 4], "little")
            if not _HEAD.size <= size <= MAX_PACKET_BYTES:
                raise CameraProtocolError(
                    f"packet of {size} bytes, wanted {_HEAD.size} to {MAX_PACKET_BYTES}: "
                    "this is no camera's preview, or bytes were lost; connect again"
                )
            if len(held) - at < size:
                break
            packets.append(_decode(bytes(held[at + 4 : at + size])))
            at += size
        del held[:at]
        return packets


def _decode(payload: bytes) -> Packet:
    kind, rest = payload[0], payload[3:]
    if kind == _STREAM:
        if len(rest) < _STREAM_HEAD.size:
            raise _short("stream", len(rest), _STREAM_HEAD.size)
        channel, stamp = _STREAM_HEAD.unpack_from(rest)
        return Stream(channel, stamp, rest[_STREAM_HEAD.size :])
    if kind == _MESSAGE:
        if len(rest) < _MESSAGE_HEAD.size:
            raise _short("message", len(rest), _MESSAGE_HEAD.size)
        code, _content, seq, _flags = _MESSAGE_HEAD.unpack_from(rest)
        return Message(code, int.from_bytes(seq, "little"), rest[_MESSAGE_HEAD.size :])
    if kind == _KEEP_ALIVE:
        return KeepAlive()
    if kind == _SYNC:
        if rest != SYNC_WORDS:
            raise CameraProtocolError(
                f"handshake {rest[:16]!r}, wanted {SYNC_WORDS!r}: another device or firmware; "
                "check the address"
            )
        return Sync()
    return Unknown(kind, rest)


def _short(kind: str, size: int, wanted: int) -> CameraProtocolError:
    return CameraProtocolError(f"{kind} packet with {size} bytes, wanted at least {wanted}")
