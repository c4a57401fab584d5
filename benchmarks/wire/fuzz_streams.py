"""Parsers of pushed and pulled streams, as targets of `fuzz.py`: RTMP, FLV, parameter sets, units.

Each is valid inputs, what reads one, and what it raises for what it cannot read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from devices.camera.address import AddressError, parse_address
from devices.camera.annex_b import (
    BitstreamError,
    avc_parameter_sets,
    hevc_parameter_sets,
    with_start_codes,
)
from devices.camera.rtmp.amf import AmfError, decode_amf, encode_amf
from devices.camera.rtmp.chunks import HANDSHAKE_BYTES, RtmpError, encode_message
from devices.camera.rtmp.session import FlvVideo, RtmpSession
from devices.camera.sources.unit_line import (
    Failed,
    LineError,
    LineReader,
    encode_failed,
    encode_format,
    encode_opened,
    encode_unit,
)
from devices.camera.units import StreamFormat, Unit
from sim.wire.flv_packets import avc_header, avc_picture

StreamTarget = tuple[tuple[bytes, ...], Callable[[bytes], object], tuple[type[Exception], ...]]

COMMANDS = (
    encode_amf("connect", 1.0, {"app": "live", "tcUrl": "rtmp://127.0.0.1/live"}),
    encode_amf("createStream", 2.0, None),
    encode_amf("publish", 3.0, None, "room", "live"),
    encode_amf("deleteStream", 4.0, None, 1.0),
)
"""What a camera says before it pushes, and when it leaves."""

PIECE_BYTES = 1000
"""Bytes that a session is given at a time, so that it stops in the middle of messages too."""


def stream_targets(picture: bytes) -> Mapping[str, StreamTarget]:
    """All of them by name.

    Args:
        picture: shape of an H.264 keyframe with its parameter sets, Annex B.
    """
    header, coded = avc_header(picture), avc_picture(picture, keyframe=True)
    pushed = (
        encode_message(1, (4096).to_bytes(4, "big"), chunk_bytes=128),
        *(encode_message(20, command, chunk_bytes=4096) for command in COMMANDS[:3]),
        encode_message(9, header, chunk_bytes=4096, channel=4, stream=1),
        encode_message(9, coded, chunk_bytes=4096, channel=4, stream=1),
    )
    form = StreamFormat("h264", picture)
    line = (
        encode_opened(),
        encode_format(form) + encode_unit(Unit(form, picture, True, 5)),
        encode_failed(Failed("the camera is gone", is_final=False)),
    )
    addresses = (b"rtmp://:1935/live/room", b"rtsp+udp://u:p@cam:554/x", b"v4l2:/dev/video0?fps=30")
    broken = (BitstreamError,)
    return {
        "RTMP": ((b"".join(pushed), *pushed), _push, (RtmpError, BitstreamError)),
        "RTMP commands": (COMMANDS, decode_amf, (AmfError,)),
        "FLV video": ((header, coded), _flv, broken),
        "avcC": ((header[5:],), avc_parameter_sets, broken),
        "hvcC": ((_hvcc(),), hevc_parameter_sets, broken),
        "access unit lengths": ((coded[5:],), lambda data: with_start_codes(data, 4), broken),
        "units of the reading process": (
            (b"".join(line), *line),
            lambda data: LineReader().take(data),
            (LineError,),
        ),
        "addresses": (addresses, _address, (AddressError,)),
    }


def _push(data: bytes) -> None:
    """A session that has been greeted takes them in pieces."""
    session = RtmpSession(lambda _path: "")
    session.take(b"\x03" + bytes(2 * HANDSHAKE_BYTES))
    for at in range(0, len(data), PIECE_BYTES):
        session.take(data[at : at + PIECE_BYTES])
        session.replies()


def _flv(data: bytes) -> None:
    video = FlvVideo()
    video.unit(data, 0)
    video.unit(data, 33)


def _address(data: bytes) -> None:
    parse_address(data.decode("utf-8", "replace"))


def _hvcc() -> bytes:
    """A record of HEVC with one parameter set of each kind."""
    sets = b"".join(bytes([kind]) + b"\0\1\0\4abcd" for kind in (32, 33, 34))
    return b"\1" + bytes(20) + b"\xff\3" + sets
