"""A simulated camera that pushes RTMP, as a 360° camera's phone app does."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from devices.camera.rtmp.chunks import RtmpError
from devices.clock import Clock
from devices.messages import EncodedFrame
from devices.video import H264Encoder
from scenes.workers.task import Task
from sim.wire.feed import FedPicture, paced
from sim.wire.flv_packets import avc_header, avc_picture
from sim.wire.rtmp_client import RtmpClient

RETRY_S = 0.5
"""Seconds between attempts to connect again."""

STALLED_S = 3.0
"""Seconds of no progress in sending after which the camera gives a connection up."""


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
