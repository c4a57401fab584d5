"""One decoded picture of a stream, left in the planes that the decoder wrote: Y, U, V.

A whole 5760×2880 picture takes longer to convert to RGB than to decode, so only what is used of it
is converted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import cv2
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

Plane = NDArray[np.uint8]

PLANAR = frozenset({"yuv420p", "yuvj420p"})
"""FFmpeg's pixel formats whose planes are used as they are."""

FULL_RANGE = 2
"""FFmpeg's number of the colour range in which Y runs from 0 to 255."""

BT601_SPACES = frozenset({5, 6})
"""FFmpeg's numbers of the two colour spaces of BT.601."""


@dataclass(frozen=True, slots=True, eq=False)
class StreamPicture:
    """One picture, 4:2:0.

    Attributes:
        y: (H, W) uint8, read-only.
        u: (⌈H/2⌉, ⌈W/2⌉) uint8.
        v: likewise.
        is_full_range: whether Y runs from 0 to 255 instead of 16 to 235.
        matrix: "bt601" or "bt709".
    """

    y: Plane
    u: Plane
    v: Plane
    is_full_range: bool = False
    matrix: str = "bt709"

    @property
    def width_px(self) -> int:
        """Width of the picture."""
        return int(self.y.shape[1])

    @property
    def height_px(self) -> int:
        """Height of the picture."""
        return int(self.y.shape[0])

    def rgb(self) -> NDArray[np.uint8]:
        """The whole picture, (H, W, 3) uint8; one row or column less where H or W is odd."""
        height, width = self.height_px & ~1, self.width_px & ~1
        half = (slice(height // 2), slice(width // 2))
        return self.to_rgb(self.y[:height, :width], self.u[half], self.v[half])

    def to_rgb(self, y: Plane, u: Plane, v: Plane) -> NDArray[np.uint8]:
        """Any planes of this picture's colours as RGB.

        Args:
            y: (h, w), both even.
            u: (h/2, w/2).
            v: likewise.

        Returns:
            (h, w, 3) uint8.
        """
        height, width = y.shape
        planes = np.empty((height * 3 // 2, width), np.uint8)
        planes[:height] = y
        chroma = planes[height:].reshape(2, height // 2, width // 2)
        chroma[0], chroma[1] = u, v
        frame = cast("Any", VideoFrame.from_numpy_buffer(planes, format="yuv420p"))
        converted = frame.reformat(
            format="rgb24",
            src_colorspace=Colorspace.ITU601 if self.matrix == "bt601" else Colorspace.ITU709,
            src_color_range=ColorRange.JPEG if self.is_full_range else ColorRange.MPEG,
        )
        return np.asarray(converted.to_ndarray(), dtype=np.uint8)


def picture_of(frame: VideoFrame) -> StreamPicture:
    """A decoded frame's picture; its planes are shared with it where it has 4:2:0 planes."""
    is_full = int(frame.color_range) == FULL_RANGE or frame.format.name.startswith("yuvj")
    matrix = "bt601" if int(frame.colorspace) in BT601_SPACES else "bt709"
    if frame.format.name not in PLANAR:
        # swscale keeps the range only where both ranges are given: it is left as it is.
        frame = frame.reformat(format="yuvj420p" if is_full else "yuv420p")
    width, height = frame.width, frame.height
    half = (-(-height // 2), -(-width // 2))
    y, u, v = (
        _plane(plane, shape)
        for plane, shape in zip(frame.planes, ((height, width), half, half), strict=True)
    )
    return StreamPicture(y, u, v, is_full, matrix)


def picture_from_rgb(rgb: NDArray[np.uint8]) -> StreamPicture:
    """The planes of an RGB picture (H, W, 3), H and W even, BT.601 full range as in JPEG."""
    ycc = cv2.cvtColor(rgb, cv2.COLOR_RGB2YCrCb)
    half = (rgb.shape[1] // 2, rgb.shape[0] // 2)
    v, u = (
        np.asarray(cv2.resize(ycc[..., k], half, interpolation=cv2.INTER_AREA), np.uint8)
        for k in (1, 2)
    )
    return StreamPicture(np.array(ycc[..., 0], np.uint8), u, v, True, "bt601")


def _plane(plane: Any, shape: tuple[int, int]) -> Plane:
    data = np.frombuffer(cast("bytes", plane), np.uint8)
    rows = data[: shape[0] * plane.line_size].reshape(shape[0], plane.line_size)
    view = rows[:, : shape[1]]
    view.setflags(write=False)
    return view
