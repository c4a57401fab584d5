"""Pictures as the headset's camera sends them: H.264, HEVC or raw; one in, one out."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Protocol, cast

import av
import numpy as np
from av.video.frame import PictureType, VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

from devices.hololens.wire.personal_video import (
    ACCESS_UNIT_DELIMITER,
    ANY_PICTURE_DELIMITER,
    GROUP_OPTION,
    Profile,
    VideoRequest,
)
from devices.hololens.wire.video_formats import encode_raw

PROFILE_NAMES = {
    Profile.H264_BASE: "baseline",
    Profile.H264_MAIN: "main",
    Profile.H264_HIGH: "high",
    Profile.HEVC_MAIN: "main",
}
"""Names of the profiles among encoders."""

MIN_BITRATE, MAX_BITRATE = 100_000, 100_000_000
"""Limits of what a client may ask for, bits a second."""

MAX_GROUP = 600
"""Most pictures from one keyframe to the next that a client may ask for."""


class Encoder(Protocol):
    """Codes pictures."""

    def encode(self, rgb: NDArray[np.uint8]) -> bytes:
        """Return one picture's bytes."""
        ...


def encoder_for(request: VideoRequest) -> Encoder:
    """Return what codes pictures as a client has asked for."""
    return RawEncoder() if request.profile is Profile.RAW else GroupEncoder(request)


def _planes(rgb: NDArray[np.uint8], pixels: str) -> Any:
    picture = VideoFrame.from_numpy_buffer(np.ascontiguousarray(rgb), format="rgb24")
    return picture.reformat(
        format=pixels, dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG
    )


class RawEncoder:
    """Codes nothing: NV12 with long rows."""

    def encode(self, rgb: NDArray[np.uint8]) -> bytes:
        """Return one picture's bytes."""
        return encode_raw(cast("NDArray[np.uint8]", _planes(rgb, "nv12").to_ndarray()))


class GroupEncoder:
    """Codes H.264 or HEVC without B pictures and without delay, parameter sets at keyframes.

    Args:
        request: size, rates and profile.
    """

    def __init__(self, request: VideoRequest) -> None:
        self._is_hevc = request.profile is Profile.HEVC_MAIN
        context = cast(
            "Any", av.CodecContext.create("libx265" if self._is_hevc else "libx264", "w")
        )
        context.width, context.height = request.width_px, request.height_px
        context.pix_fmt = "yuv420p"
        context.framerate = Fraction(max(request.fps, 1))
        context.time_base = Fraction(1, max(request.fps, 1))
        context.bit_rate = min(max(request.bitrate, MIN_BITRATE), MAX_BITRATE)
        wanted = dict(request.options).get(GROUP_OPTION, request.fps)
        self._group = min(max(wanted, 1), MAX_GROUP)
        context.gop_size = self._group
        context.max_b_frames = 0
        context.thread_count = 1
        context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
        context.options = {
            "preset": "ultrafast",
            "tune": "zerolatency",
            "profile": PROFILE_NAMES[request.profile],
            **(
                {"x265-params": "log-level=none:frame-threads=1:pools=none:repeat-headers=1"}
                if self._is_hevc
                else {"x264-params": "scenecut=0:threads=1"}
            ),
        }
        context.open()
        self._context = context
        self._count = 0

    def encode(self, rgb: NDArray[np.uint8]) -> bytes:
        """Return one picture's bytes; in H.264 a delimiter of six bytes leads."""
        picture = _planes(rgb, "yuv420p")
        is_key = self._count % self._group == 0
        picture.pict_type = PictureType.I if is_key else PictureType.NONE
        picture.pts = self._count
        picture.time_base = self._context.time_base
        self._count += 1
        data = b"".join(bytes(packet) for packet in self._context.encode(picture))
        if self._is_hevc:
            return data
        return (ACCESS_UNIT_DELIMITER if is_key else ANY_PICTURE_DELIMITER) + data
