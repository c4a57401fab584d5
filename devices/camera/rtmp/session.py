"""One publisher of RTMP, seen from the server: bytes in, replies and pictures out. No sockets.

Only what a camera needs to push its stream: nothing is played back to anyone.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from devices.camera.annex_b import (
    BitstreamError,
    ParameterSets,
    avc_parameter_sets,
    hevc_parameter_sets,
    with_start_codes,
)
from devices.camera.rtmp.amf import AmfError, AmfValue, decode_amf, encode_amf
from devices.camera.rtmp.chunks import (
    HANDSHAKE_BYTES,
    MAX_MESSAGE_BYTES,
    ChunkReader,
    Message,
    RtmpError,
    encode_message,
)
from devices.camera.units import StreamFormat, Unit

REPLY_CHUNK_BYTES = 65536
"""Our chunk size, bytes: publishers of FFmpeg's kind send in the size that we announce."""

WINDOW_BYTES = 2_500_000
"""Bytes after which either side acknowledges: what FFmpeg and nginx-rtmp announce."""

ACKNOWLEDGEMENT, USER_CONTROL, WINDOW, PEER_BANDWIDTH = 3, 4, 5, 6

VIDEO, COMMAND_3, COMMAND = 9, 17, 20

STREAM_BEGIN, PING, PONG = 0, 6, 7

Refusal = str
"""Why somebody may not publish, in words; empty if they may."""

AVC, HEVC_UNOFFICIAL = 7, 12
"""FLV's codec ids of H.264 and, as some cameras send it, of HEVC."""

FOURCC_CODECS = {b"avc1": "h264", b"hvc1": "hevc"}
"""FFmpeg's names of the codecs by the four letters of Enhanced RTMP."""

KEYFRAME = 1
"""Frame type of a picture where decoding may start."""

HEADER, PICTURE, END, PICTURE_WITHOUT_OFFSET = 0, 1, 2, 3
"""Packet types; the last one has no composition time before the picture."""


class Stage(Enum):
    """How far a connection has come."""

    GREETING = 1
    COMMANDS = 2
    PUBLISHING = 3
    ENDED = 4


class RtmpSession:
    """One connection.

    Args:
        admit: asked with `application/key` when somebody wants to publish; None if that is not
            known yet, then `settle` says it.

    Attributes:
        stage: how far it has come.
        refusal: why it was refused, else empty.
        waiting: the `application/key` that is not settled, else empty.
    """

    def __init__(self, admit: Callable[[str], Refusal | None]) -> None:
        self.stage = Stage.GREETING
        self.refusal: Refusal = ""
        self.waiting = ""
        self._admit = admit
        self._greeting = bytearray()
        self._chunks = ChunkReader()
        self._video = FlvVideo()
        self._application = ""
        self._replies: list[bytes] = []
        self._received_bytes = 0
        self._acknowledged_bytes = 0

    def take(self, data: bytes) -> list[Unit]:
        """The pictures that are whole now; `replies` has what is to be sent.

        Raises:
            RtmpError: the bytes are no RTMP.
            BitstreamError: the pictures are nothing that is decoded here.
        """
        self._received_bytes += len(data)
        if self.stage is Stage.GREETING:
            data = self._greeted(data)
        units: list[Unit] = []
        if data or self.stage is not Stage.GREETING:
            for message in self._chunks.take(data):
                unit = self._message(message)
                if unit is not None:
                    units.append(unit)
        if self._received_bytes - self._acknowledged_bytes >= WINDOW_BYTES:
            self._acknowledged_bytes = self._received_bytes
            self._send(ACKNOWLEDGEMENT, (self._received_bytes & 0xFFFFFFFF).to_bytes(4, "big"))
        return units

    def replies(self) -> bytes:
        """Take the bytes to be sent; they are given once."""
        replies = b"".join(self._replies)
        self._replies.clear()
        return replies

    def _greeted(self, data: bytes) -> bytes:
        """Answer C0 and C1 once; what follows C2."""
        before = len(self._greeting)
        self._greeting += data
        if self._greeting[0] != 3:
            raise RtmpError(f"RTMP: greeting begins with {self._greeting[0]}, wanted 3")
        first, both = 1 + HANDSHAKE_BYTES, 1 + 2 * HANDSHAKE_BYTES
        if before < first <= len(self._greeting):
            self._replies += [b"\x03", bytes(HANDSHAKE_BYTES), bytes(self._greeting[1:first])]
        if len(self._greeting) < both:
            return b""
        rest = bytes(self._greeting[both:])
        self._greeting.clear()
        self.stage = Stage.COMMANDS
        return rest

    def _message(self, message: Message) -> Unit | None:
        if message.kind == VIDEO and self.stage is Stage.PUBLISHING:
            return self._video.unit(message.data, message.time_ms)
        if message.kind in (COMMAND, COMMAND_3):
            # The AMF3 form of a command is AMF0 after one byte.
            self._command(message.data[1:] if message.kind == COMMAND_3 else message.data)
        elif message.kind == USER_CONTROL and message.data[:2] == PING.to_bytes(2, "big"):
            self._send(USER_CONTROL, PONG.to_bytes(2, "big") + message.data[2:6])
        return None

    def _command(self, data: bytes) -> None:
        try:
            values = decode_amf(data)
        except AmfError as error:
            raise RtmpError(f"RTMP command: {error}") from None
        name = values[0] if values else None
        number = values[1] if len(values) > 1 and isinstance(values[1], float) else 0.0
        if name == "connect":
            self._connect(number, values[2:])
        elif name == "createStream":
            self._answer("_result", number, None, 1.0)
        elif name == "publish":
            self._publish(_text(values, 3))
        elif name in ("FCUnpublish", "deleteStream", "closeStream"):
            self.stage = Stage.ENDED if self.stage is Stage.PUBLISHING else self.stage
        elif name == "play":
            self._refuse("NetStream.Play.Failed", "this studio receives pictures and plays none")
        elif name in ("releaseStream", "FCPublish", "_checkbw", "getStreamLength"):
            self._answer("_result", number, None, None)

    def _connect(self, number: float, values: list[AmfValue]) -> None:
        fields = values[0] if values and isinstance(values[0], dict) else {}
        application = fields.get("app")
        self._application = application.strip("/") if isinstance(application, str) else ""
        self._send(WINDOW, WINDOW_BYTES.to_bytes(4, "big"))
        self._send(PEER_BANDWIDTH, WINDOW_BYTES.to_bytes(4, "big") + b"\x02")
        self._send(1, REPLY_CHUNK_BYTES.to_bytes(4, "big"))
        self._answer(
            "_result",
            number,
            {"fmsVer": "FMS/3,0,1,123", "capabilities": 31.0},
            {
                "level": "status",
                "code": "NetConnection.Connect.Success",
                "description": "Connection succeeded.",
                "objectEncoding": 0.0,
            },
        )

    def _publish(self, key: str) -> None:
        if self.stage is not Stage.COMMANDS or self.waiting:
            return
        path = f"{self._application}/{key.partition('?')[0]}".strip("/")
        refusal = self._admit(path)
        if refusal is None:
            self.waiting = path
        else:
            self._settle(path, refusal)

    def settle(self, refusal: Refusal) -> None:
        """Answer who waits: why it may not publish, or empty; `replies` has what is to be sent."""
        path, self.waiting = self.waiting, ""
        self._settle(path, refusal)

    def _settle(self, path: str, refusal: Refusal) -> None:
        if refusal:
            self._refuse("NetStream.Publish.BadName", refusal)
            return
        self.stage = Stage.PUBLISHING
        self._chunks.max_bytes = MAX_MESSAGE_BYTES
        self._send(USER_CONTROL, STREAM_BEGIN.to_bytes(2, "big") + (1).to_bytes(4, "big"))
        self._status("status", "NetStream.Publish.Start", f"{path} is received")

    def _refuse(self, code: str, text: str) -> None:
        self.refusal = text
        self.stage = Stage.ENDED
        self._status("error", code, text)

    def _status(self, level: str, code: str, text: str) -> None:
        fields: AmfValue = {"level": level, "code": code, "description": text}
        self._send(COMMAND, encode_amf("onStatus", 0.0, None, fields), channel=5, stream=1)

    def _answer(self, name: str, number: float, *values: AmfValue) -> None:
        self._send(COMMAND, encode_amf(name, number, *values))

    def _send(self, kind: int, data: bytes, *, channel: int = 3, stream: int = 0) -> None:
        channel = 2 if kind != COMMAND else channel
        size = REPLY_CHUNK_BYTES if kind == COMMAND else 128
        self._replies.append(
            encode_message(kind, data, channel=channel, stream=stream, chunk_bytes=size)
        )


def _text(values: list[AmfValue], index: int) -> str:
    value = values[index] if len(values) > index else None
    return value if isinstance(value, str) else ""


class FlvVideo:
    """Turns the video messages of one publisher into units, one in, at most one out."""

    def __init__(self) -> None:
        self._sets: ParameterSets | None = None
        self._format: StreamFormat | None = None

    def unit(self, data: bytes, time_ms: int) -> Unit | None:
        """The picture of a message; None for headers, and for pictures before the first header.

        Raises:
            BitstreamError: another codec, or lengths that do not fit.
        """
        if len(data) < 5:
            return None
        if data[0] & 0x80:
            return self._enhanced(data, time_ms)
        codec = {AVC: "h264", HEVC_UNOFFICIAL: "hevc"}.get(data[0] & 0x0F)
        if codec is None:
            raise BitstreamError(
                f"video codec {data[0] & 0x0F} of FLV: wanted H.264 (7); set the camera to H.264"
            )
        keyframe = data[0] >> 4 == KEYFRAME
        kind = data[1]
        if kind == HEADER:
            self._begin(codec, data[5:])
            return None
        return self._picture(data[5:], time_ms + _signed(data[2:5]), keyframe, kind)

    def _enhanced(self, data: bytes, time_ms: int) -> Unit | None:
        kind, keyframe = data[0] & 0x0F, data[0] >> 4 & 7 == KEYFRAME
        codec = FOURCC_CODECS.get(data[1:5])
        if codec is None:
            raise BitstreamError(
                f"video codec {data[1:5]!r}: wanted avc1 or hvc1; set the camera to H.264"
            )
        if kind == HEADER:
            self._begin(codec, data[5:])
            return None
        if kind == PICTURE_WITHOUT_OFFSET:
            return self._picture(data[5:], time_ms, keyframe, PICTURE)
        return self._picture(data[8:], time_ms + _signed(data[5:8]), keyframe, kind)

    def _begin(self, codec: str, record: bytes) -> None:
        """Take a header; the same one again, as some cameras send, changes nothing."""
        sets = avc_parameter_sets(record) if codec == "h264" else hevc_parameter_sets(record)
        if sets != self._sets or self._format is None or self._format.codec != codec:
            self._sets, self._format = sets, StreamFormat(codec, sets.annex_b)

    def _picture(self, data: bytes, pts_ms: int, keyframe: bool, kind: int) -> Unit | None:
        if kind != PICTURE or self._sets is None or self._format is None or not data:
            return None
        access_unit = with_start_codes(data, self._sets.length_bytes)
        if keyframe:
            access_unit = self._sets.annex_b + access_unit
        return Unit(self._format, access_unit, keyframe, pts_ms * 1_000_000)


def _signed(data: bytes) -> int:
    return int.from_bytes(data, "big", signed=True)
