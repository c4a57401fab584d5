"""Decoded pictures of a headset as bytes between the process that receives and the one that asks.

Sizes are fixed or said, and both ends are this program on this machine.
"""

from __future__ import annotations

import json
import struct
from dataclasses import asdict
from io import BufferedIOBase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.camera.stream_decoder import StreamPicture
from devices.hololens.camera.stream import DecodedVideo
from devices.hololens.values import StreamState, StreamStatus
from devices.hololens.wire.packets import Packet, read_matrix
from devices.hololens.wire.personal_video import encode_trailer, read_payload

HEAD = struct.Struct("<BI")
"""Kind of a message, and bytes of what follows."""

PICTURE, STATUS, UNIT, WANTS_CAMERA = 1, 2, 3, 4
"""Kinds: a decoded picture, how it goes, an encoded picture, and that the camera shall run."""

ABOUT = struct.Struct("<QQ80s64sIIBB")
"""Before a picture's planes: number, ticks, trailer, pose, size, full range, BT.601."""

UNIT_HEAD = struct.Struct("<QBB")
"""Before an encoded picture: ticks, whether it is a keyframe, whether a connection begins."""

MAX_BYTES = 1 << 27
"""Largest message, bytes: a picture of 8192 × 8192 pixels has 96 MiB."""


def pack_picture(decoded: DecodedVideo) -> bytes:
    """Return a picture's message."""
    picture = decoded.picture
    pose = np.zeros((4, 4)) if decoded.packet.pose is None else decoded.packet.pose
    about = ABOUT.pack(
        decoded.seq,
        decoded.packet.ticks,
        encode_trailer(decoded.trailer),
        np.asarray(pose, "<f4").tobytes(),
        picture.width_px,
        picture.height_px,
        picture.is_full_range,
        picture.matrix == "bt601",
    )
    planes = [np.ascontiguousarray(plane).tobytes() for plane in (picture.y, picture.u, picture.v)]
    return _message(PICTURE, about + b"".join(planes))


def read_picture(body: bytes, arrived_ns: int) -> DecodedVideo:
    """Return the picture of a message.

    Raises:
        ValueError: its planes have another size.
    """
    seq, ticks, trailer, pose, width, height, is_full, is_601 = ABOUT.unpack_from(body)
    half = (-(-height // 2), -(-width // 2))
    planes: list[NDArray[np.uint8]] = []
    at = ABOUT.size
    for shape in ((height, width), half, half):
        size = shape[0] * shape[1]
        planes.append(np.frombuffer(body, np.uint8, size, at).reshape(shape))
        at += size
    y, u, v = planes
    picture = StreamPicture(y, u, v, bool(is_full), "bt601" if is_601 else "bt709")
    _, about = read_payload(trailer)
    return DecodedVideo(seq, Packet(ticks, b"", read_matrix(pose)), arrived_ns, about, picture)


def pack_unit(ticks: int, data: bytes, *, is_keyframe: bool, begins: bool) -> bytes:
    """Return an encoded picture's message."""
    return _message(UNIT, UNIT_HEAD.pack(ticks, is_keyframe, begins) + data)


def read_unit(body: bytes) -> tuple[int, bool, bool, bytes]:
    """Return ticks, whether it is a keyframe, whether a connection begins, and the bytes."""
    ticks, is_keyframe, begins = UNIT_HEAD.unpack_from(body)
    return ticks, bool(is_keyframe), bool(begins), body[UNIT_HEAD.size :]


def pack_status(status: StreamStatus) -> bytes:
    """Return the message of how it goes."""
    return _message(STATUS, json.dumps(asdict(status)).encode())


def read_status(body: bytes) -> StreamStatus:
    """Return how it goes.

    Raises:
        ValueError, TypeError: it is none.
    """
    values: dict[str, Any] = json.loads(body)
    values["state"] = StreamState(values["state"])
    return StreamStatus(**values)


def pack_wish() -> bytes:
    """Return the message that the camera shall run."""
    return _message(WANTS_CAMERA, b"")


def read_message(stream: BufferedIOBase) -> tuple[int, bytes] | None:
    """Return the next message's kind and body; None if the other end is gone."""
    head = stream.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    kind, size = HEAD.unpack(head)
    if size > MAX_BYTES:
        return None
    body = stream.read(size)
    return None if len(body) < size else (kind, body)


def _message(kind: int, body: bytes) -> bytes:
    return HEAD.pack(kind, len(body)) + body
