"""Video messages of RTMP and FLV: H.264, HEVC, and the fourcc form that later programs send.

Adobe, "Video File Format Specification 10.1", annex E.4.3; Veovera, "Enhanced RTMP v1".
"""

from __future__ import annotations

from devices.camera.annex_b import (
    BitstreamError,
    ParameterSets,
    avc_parameter_sets,
    hevc_parameter_sets,
    with_start_codes,
)
from devices.camera.units import StreamFormat, Unit

AVC, HEVC_UNOFFICIAL = 7, 12
"""FLV's codec ids of H.264 and, as some cameras send it, of HEVC."""

FOURCC_CODECS = {b"avc1": "h264", b"hvc1": "hevc"}
"""FFmpeg's names of the codecs by the four letters of Enhanced RTMP."""

KEYFRAME = 1
"""Frame type of a picture where decoding may start."""

HEADER, PICTURE, END, PICTURE_WITHOUT_OFFSET = 0, 1, 2, 3
"""Packet types; the last one has no composition time before the picture."""


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
