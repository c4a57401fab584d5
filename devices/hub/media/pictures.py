"""A live surface's pictures as VP8, encoded once for everybody who sees it."""

from __future__ import annotations

from typing import Any, cast

import av
import cv2
import numpy as np
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType

from devices.hub.media.tracks import VIDEO_BASE, Encoded

BIT_RATE = 1_200_000
"""Of one surface, bits a second; chosen: thin letters at 1024 px, ten pictures a second."""

WHOLE_AFTER_NS = 500_000_000
"""Shortest time between two whole pictures: each is ten times the others, and who has lost one
asks again and again."""

MAX_WHOLE_PAUSE_NS = 10_000_000_000
"""Longest time between them, for whoever's request was lost."""

MAX_SIDE_PX = 1024
"""Longer side: larger pictures are made smaller."""

OPTIONS = {
    "deadline": "realtime",
    "cpu-used": "-8",
    "lag-in-frames": "0",
    "error-resilient": "1",
    "static-thresh": "100",
    "minrate": str(BIT_RATE),
    "maxrate": str(BIT_RATE),
    "bufsize": str(BIT_RATE),
}
"""Of libvpx: constant rate, no picture waits for the next, what does not change costs nothing."""


class SurfaceVideo:
    """One surface's encoder; a picture of another size begins anew."""

    def __init__(self) -> None:
        self._codec: VideoCodecContext | None = None
        self._whole_ns: int | None = None
        self._is_whole_wanted = True

    def want_whole(self) -> None:
        """Make the next picture one that can be shown without those before, if it is time."""
        self._is_whole_wanted = True

    def encode(self, jpeg: bytes, now_ns: int) -> tuple[bytes, int, bool]:
        """Return a picture's VP8, its time in 1/90,000 s, and whether it is a whole one.

        Raises:
            ValueError: it is no JPEG.
        """
        picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        if picture is None:
            raise ValueError(f"surface: {len(jpeg)} bytes are no JPEG")
        height, width = picture.shape[:2]
        scale = min(1.0, MAX_SIDE_PX / max(height, width))
        # The planes of colours have half as many pixels.
        size = (max(16, 2 * round(0.5 * scale * width)), max(16, 2 * round(0.5 * scale * height)))
        if size != (width, height):
            picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        if self._codec is None or (self._codec.width, self._codec.height) != size:
            self._codec = _new_codec(*size)
            self._whole_ns = None
        planes = cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420)
        frame = av.VideoFrame.from_ndarray(np.asarray(planes, dtype=np.uint8), format="yuv420p")
        frame.pts, frame.time_base = now_ns * 9 // 100_000, VIDEO_BASE
        since_ns = None if self._whole_ns is None else now_ns - self._whole_ns
        is_due = since_ns is None or since_ns > MAX_WHOLE_PAUSE_NS
        if is_due or (self._is_whole_wanted and since_ns is not None and since_ns > WHOLE_AFTER_NS):
            frame.pict_type = PictureType.I
            self._is_whole_wanted, self._whole_ns = False, now_ns
        packets = cast(list[Encoded], cast(Any, self._codec).encode(frame))
        data = b"".join(bytes(packet) for packet in packets)
        return data, frame.pts, any(packet.is_keyframe for packet in packets)


def _new_codec(width: int, height: int) -> VideoCodecContext:
    codec = av.CodecContext.create("libvpx", "w")
    codec.width, codec.height, codec.pix_fmt = width, height, "yuv420p"
    codec.bit_rate, codec.time_base = BIT_RATE, VIDEO_BASE
    codec.gop_size, codec.qmin, codec.qmax = 3000, 2, 50
    codec.thread_count = 1
    codec.options = OPTIONS
    return codec
