# pyright: standard
"""H.264 in and out: both lenses of a 360° camera travel side by side in one picture.

One picture in gives one packet out: no B-frames, no look-ahead, a single thread, so that the same
pictures always give the same bytes. Colour is BT.709, limited range.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import cast

import av
import numpy as np
from av.codec.context import ThreadType
from av.error import FFmpegError
from av.video.frame import PictureType, VideoFrame
from av.video.reformatter import ColorRange, Colorspace, Interpolation
from numpy.typing import NDArray

from devices.messages import EncodedFrame

NANOSECONDS = 1_000_000_000

KEYFRAME_S = 2.0
"""From one keyframe to the next, seconds. Any picture is decoded from the keyframe before it, so
this is what going to an instant costs. Measured with six seconds of the study room at 2880 × 1440,
10 frames and 24 Mbit a second, one core of a Zen 4, times of the processor:

| keyframe every | size, MB/s | PSNR, dB | all of a group decoded, ms |
|--:|--:|--:|--:|
| 2 s | 3.12 | 41.03 | 554 |
| 1 s | 3.20 | 41.00 | 265 |
| 0.5 s | 3.34 | 40.96 | 141 |
| 0.3 s | 3.52 | 41.02 | 90 |
| 0.2 s | 3.79 | 41.05 | 63 |

A keyframe changes every pixel a little, and the tracker looks at what changes: with one every half
second an update of the lab takes 62 ms instead of 43 (median), at errors that do not differ beyond
the spread of six seeds. Poses come before scrubbing, which shows the keyframe's picture meanwhile.
"""


class H264Encoder:
    """Turns RGB pictures into H.264 access units (Annex B, headers at every keyframe).

    Args:
        width_px: width of the whole picture, even.
        height_px: height, even.
        fps: nominal frames per second, for rate control.
        bitrate: bits per second.
        stream_id: written into every packet.
        keyframe_interval: pictures from one keyframe to the next; default `KEYFRAME_S`.

    Raises:
        ValueError: a size is odd or too small, or a rate is not positive.
    """

    def __init__(
        self,
        width_px: int,
        height_px: int,
        fps: float,
        bitrate: int,
        *,
        stream_id: str = "camera-360",
        keyframe_interval: int | None = None,
    ) -> None:
        if width_px < 16 or height_px < 16 or width_px % 2 or height_px % 2:
            raise ValueError(
                f"H264Encoder: size {width_px}×{height_px} px, wanted even numbers of at least 16"
            )
        if not fps > 0 or not bitrate > 0:
            raise ValueError(f"H264Encoder: {fps} fps at {bitrate} bit/s, wanted both > 0")
        self._stream_id = stream_id
        self._shape = (height_px, width_px, 3)
        self._interval = keyframe_interval or max(1, round(KEYFRAME_S * fps))
        self._count = 0
        context = av.CodecContext.create("libx264", "w")
        context.width, context.height = width_px, height_px
        context.pix_fmt = "yuv420p"
        context.bit_rate = int(bitrate)
        context.framerate = Fraction(fps).limit_denominator(1001)
        context.time_base = Fraction(1, NANOSECONDS)
        context.thread_count = 1
        context.max_b_frames = 0
        context.gop_size = self._interval
        context.colorspace = Colorspace.ITU709
        context.color_range = ColorRange.MPEG
        context.options = {
            "preset": "veryfast",
            "tune": "zerolatency",
            "x264-params": "scenecut=0:threads=1",
        }
        context.open()
        self._context = context

    def begin_group(self) -> None:
        """Make the next picture a keyframe; those after it count from there."""
        self._count = 0

    def encode(self, rgb: NDArray[np.uint8], seq: int, t_ns: int) -> list[EncodedFrame]:
        """Compress one picture.

        Args:
            rgb: (H, W, 3) uint8.
            seq: frame counter, copied into the packet.
            t_ns: capture time; must grow from call to call.

        Returns:
            Exactly one packet.

        Raises:
            ValueError: the picture has another size or type than the encoder.
        """
        if rgb.shape != self._shape or rgb.dtype != np.uint8:
            raise ValueError(
                f"{self._stream_id} frame {seq}: picture {rgb.shape} {rgb.dtype}, "
                f"wanted {self._shape} uint8"
            )
        # The frame reads the array itself; the conversion makes the copy that the encoder keeps.
        pixels = np.ascontiguousarray(rgb)
        picture = VideoFrame.from_numpy_buffer(pixels, format="rgb24").reformat(
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            dst_color_range=ColorRange.MPEG,
            interpolation=Interpolation.AREA,
        )
        keyframe = self._count % self._interval == 0
        picture.pict_type = PictureType.I if keyframe else PictureType.NONE
        picture.time_base = self._context.time_base
        picture.pts = int(t_ns)
        self._count += 1
        return [
            EncodedFrame(self._stream_id, seq, t_ns, bytes(packet), packet.is_keyframe)
            for packet in self._context.encode(picture)
        ]


class H264Decoder:
    """Turns H.264 access units of one stream back into RGB pictures, one in, one out."""

    def __init__(self) -> None:
        context = av.CodecContext.create("h264", "r")
        context.thread_count = 1
        context.thread_type = ThreadType.SLICE
        context.options = {"flags": "low_delay"}
        self._context = context
        self._started = False

    def decode(self, packet: EncodedFrame) -> NDArray[np.uint8] | None:
        """Decompress one access unit.

        Returns:
            (H, W, 3) uint8 RGB, or None before the first keyframe and where a lost packet leaves
            the picture incomplete.

        Raises:
            ValueError: the bytes are not H.264; names the stream and the frame.
        """
        picture = self._decode(packet)
        if picture is None:
            return None
        rgb = picture.reformat(
            format="rgb24", src_colorspace=Colorspace.ITU709, src_color_range=ColorRange.MPEG
        ).to_ndarray()
        return cast("NDArray[np.uint8]", rgb)

    def skip(self, packet: EncodedFrame) -> None:
        """Take an access unit whose picture only those after it need: its colours are not made.

        Raises:
            ValueError: as `decode`.
        """
        self._decode(packet)

    def _decode(self, packet: EncodedFrame) -> VideoFrame | None:
        if not self._started and not packet.keyframe:
            return None
        try:
            frames = self._context.decode(av.Packet(packet.data))
        except FFmpegError as error:
            raise ValueError(
                f"{packet.stream_id} frame {packet.seq}: {len(packet.data)} bytes are not a whole "
                f"H.264 picture ({error.strerror or error})"
            ) from None
        self._started = True
        return next((frame for frame in frames if not frame.is_corrupt), None)


def side_by_side(images: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Lens pictures of one height next to each other, in order: what the encoder takes."""
    return np.concatenate(list(images), axis=1)


def split_lenses(picture: NDArray[np.uint8], lenses: int) -> tuple[NDArray[np.uint8], ...]:
    """Inverse of `side_by_side`: (H, n·W, 3) to n read-only views (H, W, 3).

    Raises:
        ValueError: the width is not a multiple of `lenses`.
    """
    width = picture.shape[1]
    if lenses < 1 or width % lenses:
        raise ValueError(f"picture {width} px wide: cannot be shared by {lenses} lenses")
    each = width // lenses
    views = tuple(picture[:, i * each : (i + 1) * each] for i in range(lenses))
    for view in views:
        view.setflags(write=False)
    return views
