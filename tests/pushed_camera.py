"""A simulated camera that pushes RTMP, as a 360° camera's phone app does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.camera.rtmp.chunks import RtmpError
from devices.clock import Clock
from devices.messages import EncodedFrame
from devices.video import H264Encoder
from scenes.workers.task import Task
from sim.wire.flv_packets import avc_header, avc_picture
from sim.wire.rtmp_client import RETRY_S, STALLED_S, RtmpClient

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """How a simulated camera encodes.

    Attributes:
        fps: nominal pictures a second, for rate control.
        bitrate: bits per second.
        keyframe_interval: pictures from one keyframe to the next.
    """

    fps: float = 30.0
    bitrate: int = 8_000_000
    keyframe_interval: int = 30


class RtmpPush:
    """Pushes pictures to an RTMP port on a thread of its own, and connects again when it breaks.

    Args:
        url: where to, e.g. `rtmp://127.0.0.1:1935/live/room`.
        pictures: in order of time; sent at their pace.
        clock: session time.
        options: how they are encoded.
        reconnects: whether a broken connection is made again.
    """

    def __init__(
        self,
        url: str,
        pictures: Iterable[FedPicture],
        clock: Clock,
        *,
        options: StreamOptions | None = None,
        reconnects: bool = True,
    ) -> None:
        self._url = url
        self._pictures = paced(pictures, clock)
        self._clock = clock
        self._options = options or StreamOptions()
        self._reconnects = reconnects
        self._shape: tuple[int, ...] = ()
        self._task = Task("push RTMP", self._run)
        self.sent = 0
        """Pictures handed to the connection."""
        self.connections = 0
        """Connections made."""
        self.error = ""
        """Error that broke the last connection, in words."""
        self._task.start()

    @property
    def is_running(self) -> bool:
        """Whether it still sends."""
        return self._task.is_running

    def close(self) -> None:
        """Stop, and wait for the thread."""
        self._task.cancel()
        self._task.join(STALLED_S + 2.0)

    def join(self, timeout_s: float) -> None:
        """Wait until all pictures are sent."""
        self._task.join(timeout_s)

    def _run(self, _task: Task[None]) -> None:
        while not self._task.is_cancelled:
            try:
                self._connection()
            except (OSError, RtmpError) as error:
                self.error = str(getattr(error, "strerror", None) or error)
            else:
                return
            if not self._reconnects:
                return
            self._task.pause(RETRY_S)

    def _connection(self) -> None:
        """One connection, until the pictures end or it breaks."""
        client = RtmpClient(self._url, timeout_s=STALLED_S)
        self.connections += 1
        encoder: H264Encoder | None = None
        try:
            for picture in self._pictures:
                if self._task.is_cancelled:
                    break
                if encoder is None or picture.rgb.shape != self._shape:
                    encoder = self._encoder(picture)
                for packet in encoder.encode(picture.rgb, self.sent, picture.t_ns):
                    self._send(client, packet)
                self.sent += 1
            client.finish()
        finally:
            client.close()

    def _encoder(self, picture: FedPicture) -> H264Encoder:
        self._shape = picture.rgb.shape
        height, width = picture.rgb.shape[:2]
        interval = self._options.keyframe_interval
        return H264Encoder(
            width,
            height,
            self._options.fps,
            self._options.bitrate,
            keyframe_interval=interval,
        )

    def _send(self, client: RtmpClient, packet: EncodedFrame) -> None:
        time_ms = packet.t_ns // 1_000_000
        if packet.keyframe:
            client.send_video(avc_header(packet.data), time_ms)
        client.send_video(avc_picture(packet.data, keyframe=packet.keyframe), time_ms)


@dataclass(frozen=True, slots=True, eq=False)
class FedPicture:
    """One picture of a simulated camera.

    Attributes:
        t_ns: when it was taken, from any origin.
        rgb: (H, W, 3) uint8, both lenses side by side.
    """

    t_ns: int
    rgb: Picture


def paced(pictures: Iterable[FedPicture], clock: Clock) -> Iterator[FedPicture]:
    """The same pictures, each not before its time after the first."""
    start_ns: int | None = None
    for picture in pictures:
        if start_ns is None:
            start_ns = clock.now_ns() - picture.t_ns
        clock.sleep_until(start_ns + picture.t_ns)
        yield picture


def numbered_pictures(
    size_px: tuple[int, int], fps: float, *, count: int | None = None
) -> Iterator[FedPicture]:
    """Two lens circles side by side with a moving bar, and the picture's number in squares.

    Args:
        size_px: width and height.
        fps: pictures a second.
        count: how many; None for no end.
    """
    ground = _two_circles(size_px)
    number = 0
    while count is None or number < count:
        picture = ground.copy()
        bar = number * 8 % size_px[0]
        picture[:, bar : bar + 8] = 255
        draw_number(picture, number)
        yield FedPicture(round(number * 1e9 / fps), picture)
        number += 1


NUMBER_BITS = 20
"""Bits of a picture's number that are drawn: more than nine hours at 30 Hz."""


def draw_number(picture: Picture, number: int) -> None:
    """Write a picture's number into its top row of squares, black or white; changes `picture`."""
    side = _square_px(picture.shape[1])
    for bit in range(NUMBER_BITS):
        value = 235 if number >> bit & 1 else 20
        picture[:side, bit * side : (bit + 1) * side] = value


def read_number(luma: Picture) -> int:
    """The number that `draw_number` wrote, from a picture's Y plane (H, W)."""
    side = _square_px(luma.shape[1])
    row = luma[side // 2]
    return sum((int(row[bit * side + side // 2]) > 127) << bit for bit in range(NUMBER_BITS))


def _square_px(width_px: int) -> int:
    """Side of a square: whole macroblocks where there is room."""
    return max(4, width_px // (2 * NUMBER_BITS))


def _two_circles(size_px: tuple[int, int]) -> Picture:
    width, height = size_px
    picture = np.zeros((height, width, 3), np.uint8)
    for lens in range(2):
        centre = (width * (2 * lens + 1) // 4, height // 2)
        radius = min(width // 4, height // 2)
        cv2.circle(picture, centre, radius, (90 + 60 * lens, 120, 160 - 60 * lens), -1)
        cv2.circle(picture, centre, radius // 3, (200, 180, 60), -1)
    return picture
