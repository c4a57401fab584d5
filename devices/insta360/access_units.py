"""Pieces of live video to whole access units, and what is in them.

Cameras put one picture into one packet; nothing promises it. As long as that holds, each packet is
passed on at once. From the first one that goes on with the picture before it (no start code, or
the same time), units are held until the next one begins: one picture later, but whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from devices.insta360.errors import CameraProtocolError
from devices.insta360.packets import MAX_PACKET_BYTES

Codec = Literal["h264", "hevc"]

MAX_UNIT_BYTES = 2 * MAX_PACKET_BYTES
"""Limit of one access unit that is put together from several packets."""

_H264_SLICES, _H264_KEYS, _H264_SPS = frozenset({1, 5}), frozenset({5}), 7
_HEVC_SLICES, _HEVC_KEYS, _HEVC_VPS = frozenset(range(32)), frozenset(range(16, 24)), 32
"""Kinds of NAL units (ITU-T H.264 and H.265, Table 7-1)."""

_SCANNED_UNITS = 64
"""NAL units of a packet that are looked at; a picture has parameter sets and few slices."""


@dataclass(frozen=True, slots=True, eq=False)
class VideoUnit:
    """One access unit as the camera sent it.

    Attributes:
        stamp: time on the camera's clock, in its own unit (`camera_time.py`).
        data: Annex B, start codes included.
        codec: found from the parameter sets.
        keyframe: whether decoding may start here.
    """

    stamp: int
    data: bytes
    codec: Codec
    keyframe: bool


class UnitAssembler:
    """Video packets in, access units out; nothing before the first parameter sets."""

    def __init__(self) -> None:
        self._held = bytearray()
        self._held_stamp = 0
        self._slice: int | None = None
        self._split = False
        self._codec: Codec | None = None

    @property
    def codec(self) -> Codec | None:
        """Codec of the stream; None before its first parameter sets."""
        return self._codec

    @property
    def split(self) -> bool:
        """Whether pictures come in more than one packet, so that each is held until the next."""
        return self._split

    def feed(self, stamp: int, data: bytes) -> list[VideoUnit]:
        """Take one video packet; the units that are whole now.

        Raises:
            CameraProtocolError: a unit grew beyond `MAX_UNIT_BYTES`.
        """
        self._codec = self._codec or _codec_of(data)
        if self._codec is None or not data:
            return []
        begins = _begins_unit(data, self._codec)
        if not begins:
            self._split = True
            if not self._held:
                return []  # its beginning was passed on before it was known to go on
        done = self._taken() if begins and self._slice is not None else []
        self._hold(stamp, data)
        if not self._split and self._slice is not None:
            done += self._taken()
        return done

    def _hold(self, stamp: int, data: bytes) -> None:
        if len(self._held) + len(data) > MAX_UNIT_BYTES:
            raise CameraProtocolError(
                f"a picture of more than {MAX_UNIT_BYTES} bytes: no camera's video"
            )
        if not self._held:
            self._held_stamp = stamp
        self._held += data
        if self._slice is None and self._codec is not None:
            slices = _HEVC_SLICES if self._codec == "hevc" else _H264_SLICES
            kinds = (_kind(data[at], self._codec) for at in _heads(data))
            self._slice = next((kind for kind in kinds if kind in slices), None)

    def _taken(self) -> list[VideoUnit]:
        data, first_slice = bytes(self._held), self._slice
        self._held.clear()
        self._slice = None
        keys = _H264_KEYS if self._codec == "h264" else _HEVC_KEYS
        codec = self._codec or "h264"
        return [VideoUnit(self._held_stamp, data, codec, first_slice in keys)]


def _heads(data: bytes) -> Iterator[int]:
    """Positions of the first bytes of the first `_SCANNED_UNITS` NAL units."""
    at = data.find(b"\0\0\1")
    for _unit in range(_SCANNED_UNITS):
        if at < 0 or at + 3 >= len(data):
            return
        yield at + 3
        at = data.find(b"\0\0\1", at + 3)


def _kind(head: int, codec: Codec) -> int:
    return head & 0x1F if codec == "h264" else head >> 1 & 0x3F


def _begins_unit(data: bytes, codec: Codec) -> bool:
    """Whether a packet is not the rest of the picture before it.

    It begins with a start code, and with what precedes slices or with a picture's first slice: the
    bit after the head is `first_slice_segment_in_pic_flag`, or a `first_mb_in_slice` of 0.
    """
    if not data.startswith((b"\0\0\0\1", b"\0\0\1")):
        return False
    at = next(_heads(data), None)
    if at is None:
        return False
    slices, head_bytes = (_H264_SLICES, 1) if codec == "h264" else (_HEVC_SLICES, 2)
    if _kind(data[at], codec) not in slices:
        return True
    return len(data) > at + head_bytes and bool(data[at + head_bytes] & 0x80)


def _codec_of(data: bytes) -> Codec | None:
    """From the first parameter set; None without one.

    HEVC's first is a VPS with head 0x40; as H.264 that would be the kind 0, which is not used.
    """
    for at in _heads(data):
        head = data[at]
        if head & 0x81 == 0 and _kind(head, "hevc") == _HEVC_VPS:
            return "hevc"
        if head & 0x80 == 0 and _kind(head, "h264") == _H264_SPS:
            return "h264"
    return None
