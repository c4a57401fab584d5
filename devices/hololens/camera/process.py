"""The process that receives and decodes a headset's video: pictures go out on standard output.

Reading and decoding a stream beside a tracker makes both late: they share one interpreter. The
process is told what to receive as one line of JSON, and that the camera runs by further lines; it
ends at the end of its standard input.
"""

from __future__ import annotations

import json
import sys
import threading
from dataclasses import asdict, replace
from io import BufferedIOBase

from devices.camera.units import SourceError
from devices.clock import Clock, WallClock
from devices.hololens.camera.received import pack_picture, pack_status, pack_unit, pack_wish
from devices.hololens.camera.stream import (
    DecodedVideo,
    VideoStream,
    is_keyframe,
    video_request,
)
from devices.hololens.links.connection import Connection, HeadsetError, StoppedError
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.plan import VideoOptions
from devices.hololens.values import StreamStatus
from devices.hololens.wire.packets import read_packet
from devices.hololens.wire.personal_video import MAX_PAYLOAD_BYTES, encode_opening, read_payload
from devices.hololens.wire.taking import WireError
from scenes.workers.pipes import widen
from scenes.workers.task import Task

SILENT_S = 8.0
"""A stream without a picture for so long is connected anew: cameras take seconds to the first."""

STATUS_S = 0.25
"""Time between two messages of how it goes, seconds."""

READY_S = 15.0
"""Longest wait for word that the camera runs, seconds; then it is tried without."""

READY = "ready"
"""Line that says so."""


def order_of(
    address: tuple[str, int], options: VideoOptions, *, retry_s: float, sends_units: bool
) -> str:
    """Return the line that says what to receive."""
    return json.dumps(
        {
            "address": address,
            "options": asdict(options),
            "retry_s": retry_s,
            "sends_units": sends_units,
        }
    )


class Receiving:
    """Receives until it is closed.

    Args:
        order: as `order_of` says.
        out: takes messages.
        clock: any clock.
    """

    def __init__(self, order: str, out: BufferedIOBase, *, clock: Clock) -> None:
        wanted = json.loads(order)
        options = VideoOptions(**wanted["options"])
        self._codec, self._sends_units = options.codec, bool(wanted["sends_units"])
        self._out, self._clock = out, clock
        self._writing = threading.Lock()
        self._ready = threading.Event()
        self._health = StreamHealth("video", clock)
        request = video_request(
            options.width_px, options.height_px, fps=options.fps, codec=options.codec
        )
        self._opening = encode_opening(request)
        self._stream = VideoStream(options.codec, clock, hand_out=self._hand_out)
        host, port = wanted["address"]
        self._link = Link(
            (host, port),
            clock,
            health=self._health,
            talk=self._talk,
            prepare=self._prepare,
            name="hololens video",
            retry_s=float(wanted["retry_s"]),
            silent_s=SILENT_S,
            silent_hint=": another program may be connected to this port; close it",
        )

    def camera_runs(self) -> None:
        """The camera was started, as was asked for."""
        self._ready.set()

    def say_status(self) -> None:
        """Send how it goes."""
        self._write(pack_status(self.status()))

    def status(self) -> StreamStatus:
        """Return how it goes; times of arrival are the asking process's to say."""
        status = self._health.status(dropped=self._stream.skipped, damaged=self._stream.damaged)
        return replace(status, last_age_ns=None, delay_ms=None)

    def close(self) -> None:
        """Hang up; waits for the threads."""
        self._link.close()
        self._stream.close()

    def _prepare(self, stop: threading.Event) -> None:
        self._ready.clear()
        self.say_status()
        self._write(pack_wish())
        until_ns = self._clock.now_ns() + round(1e9 * READY_S)
        while not (stop.is_set() or self._ready.wait(0.1)) and self._clock.now_ns() < until_ns:
            pass

    def _talk(self, connection: Connection) -> None:
        connection.send(self._opening)
        self._stream.begin()
        begins = True
        while True:
            packet = read_packet(connection.take, has_pose=True, max_bytes=MAX_PAYLOAD_BYTES)
            try:
                self._stream.put(packet, self._clock.now_ns())
            except WireError as error:
                self._health.damaged(str(error))
                continue
            except SourceError as error:
                raise HeadsetError(str(error)) from None
            self._health.came(len(packet.payload))
            if self._sends_units and self._codec != "raw":
                data, _trailer = read_payload(packet.payload)
                is_key = is_keyframe(self._codec, data)
                self._write(pack_unit(packet.ticks, data, is_keyframe=is_key, begins=begins))
            begins = False
            if connection.is_stopped:
                raise StoppedError

    def _hand_out(self, decoded: DecodedVideo) -> None:
        self._write(pack_picture(decoded))

    def _write(self, message: bytes) -> None:
        try:
            with self._writing:
                self._out.write(message)
                self._out.flush()
        except (OSError, ValueError):
            self._link.task.cancel()  # nobody reads: the process is about to end


def serve(orders: BufferedIOBase, out: BufferedIOBase) -> None:
    """Receive until there is an end of orders."""
    receiving = Receiving(orders.readline().decode(), out, clock=WallClock())

    def listen(_task: Task[None]) -> None:
        for line in orders:
            if line.decode().strip() == READY:
                receiving.camera_runs()

    listening = Task("orders", listen).start()
    while listening.is_running:
        listening.join(STATUS_S)
        receiving.say_status()
    receiving.close()


if __name__ == "__main__":
    # Whatever prints to standard output shall not get among the pictures.
    pictures = sys.stdout.buffer
    sys.stdout = sys.stderr
    widen(pictures.fileno())
    serve(sys.stdin.buffer, pictures)  # type: ignore[arg-type]
