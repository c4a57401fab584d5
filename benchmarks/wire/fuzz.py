"""Every parser of what comes over a network against hostile bytes: each input is read or refused.

A refusal is the one error that a parser's docstring names. Anything else is a defect; its seed
makes it again.
"""

from __future__ import annotations

import http.client
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np

from benchmarks.wire.fuzz_hololens import hololens_targets
from benchmarks.wire.fuzz_people import people_targets
from benchmarks.wire.fuzz_sites import site_targets
from benchmarks.wire.fuzz_streams import stream_targets
from devices.clock import ManualClock
from devices.insta360.access_units import UnitAssembler
from devices.insta360.commands import (
    INFO_OPTIONS,
    CameraInfo,
    Command,
    LiveRequest,
    get_options,
    info_reply,
    read_get_options,
    read_info,
    read_set_time,
    read_start_live,
    refusal,
    set_time,
    start_live,
)
from devices.insta360.errors import CameraProtocolError
from devices.insta360.files.metadata import Metadata, new_metadata, read_metadata, write_metadata
from devices.insta360.files.offsets import OffsetError, read_offsets, write_offsets
from devices.insta360.files.samples import (
    Exposures,
    GyroSamples,
    read_exposures,
    read_gyro,
    write_exposures,
    write_gyro,
)
from devices.insta360.files.trailer import (
    BINARY,
    EXPOSURE,
    METADATA,
    PROTOBUF,
    THUMBNAIL,
    Record,
    Trailer,
    TrailerError,
    read_trailer_of,
    trailer_bytes,
)
from devices.insta360.files.trailer import GYRO as GYRO_RECORD
from devices.insta360.osc import exchange
from devices.insta360.osc_replies import (
    read_command,
    read_files,
    read_object,
    read_state,
    read_urls,
)
from devices.insta360.osc_replies import read_info as read_osc_info
from devices.insta360.packets import (
    GYRO,
    VIDEO,
    KeepAlive,
    Message,
    PacketParser,
    Stream,
    Sync,
    Unknown,
    encode,
)
from devices.insta360.protobuf import ProtobufError, message, read_message
from sim.wire.hostile import hostile_bytes
from sim.wire.osc_camera import OscCamera
from sim.wire.rtsp.requests import Request, RequestReader, RtspError, interleaved
from sim.wire.rtsp.transport import read_transport

OFFSET_V1 = "2_2657.621_2684.250_2687.750_-0.259_-0.011_89.729_2651.033_8066.330_2692.030_0.247_-0.221_89.754_10752_5376_1137"  # noqa: E501 - one string
OFFSET_V2 = "2_2663.416_2684.250_2687.750_-0.259_-0.011_89.729_0.000000_0.000000_0.000000_1.00000000_-0.18974844_0.27346808_-0.09002038_10752_5376_113_2658.524_8066.330_2692.030_0.247_-0.221_89.754_0.000792_0.000132_-0.031986_1.00000000_-0.18765773_0.27116153_-0.08905181_10752_5376_113_132096"  # noqa: E501 - one string
OFFSET_V3 = "2_2.000000_4291.910_4291.470_2684.250_2687.750_-0.259_-0.011_89.729_0.000000_0.000000_0.000000_0.18322477_2.08857179_-3.36655450_0.00089921_0.00038060_10752_5376_113_2.000000_4278.090_4278.390_8066.330_2692.030_0.247_-0.221_89.754_0.000792_0.000132_-0.031986_0.18963484_2.04539418_-3.23319674_0.00101338_0.00195932_10752_5376_113_197632"  # noqa: E501 - one string
"""Calibration of a real X5, published in Insta360Develop/Desktop-CameraSDK-Cpp, issue 85."""

PICTURE = b"\0\0\0\1\x67\x42\0\x1e\0\0\0\1\x68\xce\0\0\1\x65\x88" + bytes(range(3, 60))
"""Shape of an H.264 keyframe: parameter sets and a slice; it cannot be decoded."""

RTSP_REQUESTS = (
    b"OPTIONS * RTSP/1.0\r\nCSeq: 1\r\nUser-Agent: Lavf\r\n\r\n",
    b"DESCRIBE rtsp://127.0.0.1/room RTSP/1.0\r\nCSeq: 2\r\nAccept: application/sdp\r\n\r\n",
    b"SETUP rtsp://127.0.0.1/room/trackID=0 RTSP/1.0\r\nCSeq: 3\r\n"
    b"Transport: RTP/AVP/UDP;unicast;client_port=5000-5001, RTP/AVP/TCP;interleaved=0-1\r\n\r\n",
    b"PLAY rtsp://127.0.0.1/room RTSP/1.0\r\nCSeq: 4\r\nSession: 1\r\nRange: npt=0.0-\r\n\r\n",
    b"GET_PARAMETER * RTSP/1.0\r\nCSeq: 5\r\nContent-Length: 4\r\n\r\nname",
    interleaved(1, bytes(32)),
)
"""What players send, in the order they send it."""


class FuzzError(Exception):
    """A parser failed otherwise than by a refusal: names it and the seed."""


@dataclass(frozen=True, slots=True)
class FuzzTarget:
    """One parser.

    Attributes:
        valid: inputs that it reads.
        read: reads one.
        refuses_with: what it raises for what it cannot read.
    """

    valid: tuple[bytes, ...]
    read: Callable[[bytes], object]
    refuses_with: tuple[type[Exception], ...]


@dataclass(frozen=True, slots=True)
class FuzzCounts:
    """How inputs went: all of them were read or refused."""

    inputs: int
    read: int
    refused: int


def fuzz(name: str, inputs: int, first_seed: int = 0) -> FuzzCounts:
    """Give a parser that many hostile inputs.

    Args:
        name: a key of `targets()`.
        inputs: how many.
        first_seed: of the first; the others follow.

    Raises:
        FuzzError: a defect.
    """
    target = targets()[name]
    refused = 0
    for seed in range(first_seed, first_seed + inputs):
        data = hostile_bytes(seed, target.valid)
        try:
            target.read(data)
        except target.refuses_with:
            refused += 1
        except Exception as error:
            raise FuzzError(
                f"{name}, seed {seed}, {len(data)} bytes: {type(error).__name__}: {error}"
            ) from error
    return FuzzCounts(inputs, inputs - refused, refused)


def targets() -> Mapping[str, FuzzTarget]:
    """All parsers by name, with inputs that they read."""
    info = CameraInfo("IXE36", "Insta360 X4", "v1.4.6", 0.9, OFFSET_V1, OFFSET_V2, OFFSET_V3)
    commands = (
        start_live(LiveRequest()),
        set_time(1_700_000_000, -3600),
        get_options(INFO_OPTIONS),
        info_reply(info, INFO_OPTIONS),
    )
    packets = tuple(encode(packet) for packet in _packets(commands))
    wire = (CameraProtocolError, ProtobufError)
    strings = tuple(text.encode() for text in (OFFSET_V1, OFFSET_V2, OFFSET_V3))
    replies = tuple(json.dumps(reply).encode() for reply in _osc_replies())
    camera = OscCamera(ManualClock(), info)
    requests = tuple(json.dumps(request).encode() for request in _osc_requests())
    return {
        "packets": FuzzTarget((b"".join(packets), *packets), _read_packets, wire),
        "access units": FuzzTarget((PICTURE, PICTURE[18:]), _read_units, wire),
        "protobuf": FuzzTarget(commands, _read_fields, (ProtobufError,)),
        "trailer": FuzzTarget(_trailers(), _read_trailer, (TrailerError, ProtobufError)),
        "offsets": FuzzTarget(strings, _read_offsets, (OffsetError,)),
        "OSC replies": FuzzTarget(replies, _read_osc, wire),
        "HTTP replies": FuzzTarget(_http(replies), _read_http, (CameraProtocolError, OSError)),
        "RTSP requests": FuzzTarget(RTSP_REQUESTS, _read_rtsp, (RtspError,)),
        "OSC requests": FuzzTarget(requests, partial(_answer_osc, camera), wire),
        **{name: FuzzTarget(*parts) for name, parts in stream_targets(PICTURE).items()},
        **{name: FuzzTarget(*parts) for name, parts in people_targets().items()},
        **{name: FuzzTarget(*parts) for name, parts in site_targets().items()},
        **{name: FuzzTarget(*parts) for name, parts in hololens_targets().items()},
    }


def _packets(
    commands: Sequence[bytes],
) -> tuple[Sync | KeepAlive | Message | Stream | Unknown, ...]:
    return (
        Sync(),
        KeepAlive(),
        *(Message(Command.GET_OPTIONS, seq, body) for seq, body in enumerate(commands)),
        Message(500, 3, b"\x12\x0fcamera is busy."),
        Stream(VIDEO, 1_000_000, PICTURE),
        Stream(GYRO, 1_000_100, bytes(56)),
        Unknown(9, b"12"),
    )


def _read_packets(data: bytes) -> None:
    """As a connection does: in pieces, videos put together, replies' reasons read."""
    parser, assembler = PacketParser(), UnitAssembler()
    middle = len(data) // 3
    for piece in (data[:middle], data[middle:]):
        for packet in parser.feed(piece):
            if isinstance(packet, Stream):
                assembler.feed(packet.stamp, packet.data)
            elif isinstance(packet, Message):
                refusal(packet)
    if parser.held_bytes > len(data):
        raise FuzzError(f"{parser.held_bytes} bytes held of {len(data)}")


def _read_units(data: bytes) -> None:
    assembler = UnitAssembler()
    assembler.feed(0, PICTURE)
    for at in range(0, len(data), 97):
        assembler.feed(at, data[at : at + 97])


def _read_fields(data: bytes) -> None:
    fields = read_message(data)
    if message(*fields) != data:
        raise FuzzError("fields do not give the bytes back")
    read_info(data)
    read_get_options(data)
    read_set_time(data)
    read_start_live(data)


def _trailers() -> tuple[bytes, ...]:
    metadata = new_metadata(
        serial="IXE36",
        camera_type="Insta360 X4",
        firmware="v1.4.6",
        offset=OFFSET_V1,
        offset_v3=OFFSET_V3,
        gyro_ranges=(16, 2000),
        first_frame_us=5_000,
    )
    t_ns = np.arange(4, dtype=np.int64) * 1_000_000
    gyro = write_gyro(GyroSamples(t_ns, np.ones((4, 3)), np.zeros((4, 3))), metadata)
    exposures = write_exposures(Exposures(t_ns, np.full(4, 0.01)), metadata)
    records = (
        Record(METADATA, PROTOBUF, write_metadata(metadata)),
        Record(THUMBNAIL, BINARY, b"\xff\xd8\xff"),
        Record(GYRO_RECORD, BINARY, gyro),
        Record(EXPOSURE, BINARY, exposures, before=bytes(16)),
    )
    plain = Trailer(records)
    indexed = Trailer(records, slots=(-1, 1, 2, 3, 4), after=bytes(8), boxed=True)
    return b"ftyp" + trailer_bytes(plain), bytes(20) + trailer_bytes(indexed)


def _read_trailer(data: bytes) -> None:
    trailer = read_trailer_of(io.BytesIO(data))
    if trailer is None:
        raise TrailerError("none")
    if not data.endswith(trailer_bytes(trailer)):
        raise FuzzError("records do not give the bytes back")
    metadata = read_metadata(trailer.data(METADATA) or b"")
    _read_metadata(metadata)
    read_gyro(trailer.data(GYRO_RECORD) or b"", metadata)
    read_exposures(trailer.data(EXPOSURE) or b"", metadata)


def _read_metadata(metadata: Metadata) -> None:
    _ = metadata.serial, metadata.camera_type, metadata.firmware, metadata.offset
    _ = metadata.first_frame_ns, metadata.rolling_shutter_s
    _ = metadata.gyro_ranges, metadata.window_crop


def _read_offsets(data: bytes) -> None:
    read = read_offsets(data.decode("utf-8", "replace"))
    if read_offsets(write_offsets(read)) != read:
        raise FuzzError("numbers do not come back")


def _osc_replies() -> tuple[dict[str, Any], ...]:
    camera = OscCamera(ManualClock(), CameraInfo("IXE36", "Insta360 X4", "v1", 0.5), picture=b"1")
    asked: list[tuple[str, dict[str, Any]]] = [("/osc/info", {}), ("/osc/state", {})]
    asked += [("/osc/commands/execute", request) for request in _osc_requests()]
    asked.append(("/osc/commands/status", {"id": "000002"}))
    return tuple(camera.answer(path, value, "http://camera")[1] for path, value in asked)


def _osc_requests() -> tuple[dict[str, Any], ...]:
    return (
        {"name": "camera.getOptions", "parameters": {"optionNames": ["iso", "_sysTimestamp"]}},
        {"name": "camera.setOptions", "parameters": {"options": {"captureMode": "image"}}},
        {"name": "camera.takePicture"},
        {"name": "camera.startCapture"},
        {"name": "camera.stopCapture"},
        {"name": "camera.listFiles", "parameters": {"fileType": "all", "entryCount": 9}},
        {"id": "000002"},
    )


def _read_osc(data: bytes) -> None:
    """Every reader, whatever the reply belongs to; refused if none reads it."""
    read = 0
    for reader in (read_osc_info, read_state):
        try:
            reader(data)
            read += 1
        except CameraProtocolError:
            continue
    try:
        command = read_command(data)
        read_files(command.results)
        read_urls(command.results)
    except CameraProtocolError:
        if not read:
            raise


def _http(replies: Sequence[bytes]) -> tuple[bytes, ...]:
    whole = [
        b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n%b"
        % (len(reply), reply)
        for reply in replies
    ]
    whole.append(
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n4\r\n{   \r\n1\r\n}\r\n0\r\n\r\n"
    )
    whole.append(b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.0 404 No\r\nX: 1\r\n\r\n{}")
    return tuple(whole)


class _Answering:
    """Stands for a connected socket whose other side has sent its reply already."""

    def __init__(self, reply: bytes) -> None:
        self._reply = reply

    def sendall(self, _data: bytes) -> None:
        """Requests are not looked at."""

    def makefile(self, *_mode: object) -> io.BytesIO:
        """The reply."""
        return io.BytesIO(self._reply)

    def close(self) -> None:
        """Nothing to close."""


def _read_http(data: bytes) -> None:
    connection = http.client.HTTPConnection("camera")
    connection.sock = cast(Any, _Answering(data))
    _status, body = exchange(connection, "GET", "/osc/info", None)
    read_object(body)


def _answer_osc(camera: OscCamera, data: bytes) -> None:
    """The simulated camera's side; its state goes on from request to request."""
    value = read_object(data)
    for path in ("/osc/commands/execute", "/osc/commands/status"):
        json.dumps(camera.answer(path, value, "http://camera")[1])


def _read_rtsp(data: bytes) -> None:
    """As the server does, in pieces; at the end a connection holds no more than it was sent."""
    reader = RequestReader()
    middle = len(data) // 3
    for piece in (data[:middle], data[middle:]):
        for found in reader.feed(piece):
            if isinstance(found, Request):
                read_transport(found.headers.get("transport", ""))
    if reader.held_bytes > len(data):
        raise FuzzError(f"{reader.held_bytes} bytes held of {len(data)}")
