"""The headset's camera: started, streamed from, decoded, and handed to every consumer."""

from __future__ import annotations

import threading
from contextlib import suppress

from devices.adapter import Sink
from devices.camera.units import SourceError
from devices.clock import Clock
from devices.hololens.axes import camera_of, camera_pose
from devices.hololens.configuration import Configuration
from devices.hololens.links.connection import Connection, HeadsetError, StoppedError
from devices.hololens.links.fan_out import FanOut
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.plan import MAX_RETRY_S, VideoOptions
from devices.hololens.values import PersonalVideoFrame, StreamStatus
from devices.hololens.video_stream import (
    DecodedVideo,
    VideoStream,
    is_keyframe,
    video_request,
)
from devices.hololens.wire.packets import Packet, read_packet
from devices.hololens.wire.personal_video import (
    MAX_PAYLOAD_BYTES,
    StartVideo,
    StopVideo,
    encode_opening,
    read_payload,
)
from devices.hololens.wire.remote_configuration import Request, Setting
from devices.hololens.wire.taking import WireError
from devices.messages import EncodedFrame
from devices.streams import StreamClosedError, StreamFullError

READY_S, POLL_S = 10.0, 0.1
"""Longest wait for the camera to start, and how often it is asked, seconds; it takes 1 to 2 s."""

SILENT_S = 8.0
"""A stream without a picture for so long is connected anew: cameras take seconds to the first."""

ASK_S = 1.0
"""Longest wait for one answer."""

STREAM_ID = "hololens-video"
"""Name of its packets in recordings."""


class Video:
    """Personal video of one headset; starts at once.

    Args:
        address: of the port.
        clock: session time.
        options: what is asked for.
        configuration: of the same headset.
        packets: takes every encoded picture, in order; it must not block.
        retry_s: longest wait between two attempts to connect.
    """

    def __init__(
        self,
        address: tuple[str, int],
        clock: Clock,
        *,
        options: VideoOptions,
        configuration: Configuration,
        packets: Sink[EncodedFrame] | None = None,
        retry_s: float = MAX_RETRY_S,
    ) -> None:
        self.frames: FanOut[PersonalVideoFrame] = FanOut()
        self._address, self._clock, self._options = address, clock, options
        self._configuration, self._packets = configuration, packets
        self._health = StreamHealth("video", clock)
        self._opening = encode_opening(
            video_request(options.width_px, options.height_px, options.fps, codec=options.codec)
        )
        self._recorded = 0
        self._stream = VideoStream(options.codec, clock, hand_out=self._hand_out)
        self._link = Link(
            address,
            clock,
            health=self._health,
            talk=self._talk,
            prepare=self._prepare,
            name="hololens video",
            retry_s=retry_s,
            silent_s=SILENT_S,
            silent_hint=": another program may be connected to this port; close it",
        )

    @property
    def health(self) -> StreamHealth:
        """How it is doing."""
        return self._health

    def status(self) -> StreamStatus:
        """Return how it is doing, with what the decoder and consumers left out."""
        dropped = self._stream.skipped + self.frames.dropped
        return self._health.status(dropped=dropped, damaged=self._stream.damaged)

    def close(self) -> None:
        """Hang up, and stop the camera; waits for the threads."""
        self._link.close()
        self._stream.close()
        self.frames.close()
        with suppress(HeadsetError):
            self._say(StopVideo(), threading.Event())

    def _prepare(self, stop: threading.Event) -> None:
        """Start the camera, if it does not run already."""
        if self._is_running() is True:
            return
        self._say(StartVideo(), stop)
        until_ns = self._clock.now_ns() + round(1e9 * READY_S)
        while not stop.wait(POLL_S):
            is_running = self._is_running()
            # Where nobody answers, the stream itself says whether there is a camera.
            if is_running is not False:
                return
            if self._clock.now_ns() > until_ns:
                raise HeadsetError(
                    f"{self._address[0]}: the camera did not start within {READY_S:g} s; another "
                    "app on the headset may have it: close that"
                )

    def _is_running(self) -> bool | None:
        """Whether the camera runs; None where nobody says."""
        try:
            return self._configuration.ask(Request(Setting.VIDEO_STATUS), ASK_S) == (1,)
        except HeadsetError:
            return None

    def _say(self, opening: StartVideo | StopVideo, stop: threading.Event) -> None:
        """Say one thing over a connection of its own, and wait until it was taken."""
        connection = Connection(self._address, self._clock, stop=stop, silent_s=ASK_S)
        try:
            connection.send(encode_opening(opening))
            connection.is_over(POLL_S)
        finally:
            connection.close()

    def _talk(self, connection: Connection) -> None:
        connection.send(self._opening)
        self._stream.begin()
        is_first = True
        while True:
            packet = read_packet(connection.take, has_pose=True, max_bytes=MAX_PAYLOAD_BYTES)
            arrived_ns = self._clock.now_ns()
            taken_ns = self._configuration.session_ns(packet.ticks)
            delay_ns = None if taken_ns is None else arrived_ns - taken_ns
            try:
                self._stream.put(packet, arrived_ns)
            except WireError as error:
                self._health.damaged(str(error))
                continue
            except SourceError as error:
                raise HeadsetError(f"{self._address[0]}: {error}") from None
            self._health.came(len(packet.payload), delay_ns=delay_ns)
            self._record(packet, arrived_ns if taken_ns is None else taken_ns, begins=is_first)
            is_first = False
            if connection.is_stopped:
                raise StoppedError

    def _record(self, packet: Packet, t_ns: int, *, begins: bool) -> None:
        if self._packets is None or self._options.codec == "raw":
            return
        data, _trailer = read_payload(packet.payload)
        codec = self._options.codec
        frame = EncodedFrame(
            STREAM_ID,
            self._recorded,
            t_ns,
            data,
            is_keyframe(codec, data),
            codec=codec,
            begins=begins,
        )
        self._recorded += 1
        try:
            self._packets.put(frame)
        except (StreamFullError, StreamClosedError) as error:
            self._health.damaged(f"encoded pictures are not saved: {error}")

    def _hand_out(self, decoded: DecodedVideo) -> None:
        picture = decoded.picture
        t_ns = self._configuration.session_ns(decoded.packet.ticks)
        try:
            frame = PersonalVideoFrame(
                decoded.seq,
                decoded.arrived_ns if t_ns is None else t_ns,
                decoded.arrived_ns,
                picture,
                camera_of(decoded.trailer, picture.width_px, picture.height_px),
                camera_pose(decoded.packet),
            )
        except WireError as error:
            self._health.damaged(str(error))
            return
        self.frames.put(frame)
