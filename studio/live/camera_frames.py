"""Pictures of a live camera as the session's messages: the newest whenever one is taken."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from devices.camera.lenses.lens_pictures import stream_images
from devices.camera.received import Received
from devices.camera.receiver import CameraReceiver
from devices.clock import Clock
from devices.clock_mapping import ClockEstimate, ClockMapping, add_arrival, estimate
from devices.messages import EncodedFrame, Event, Frame
from devices.session_info import LiveStream
from scenes.cameras import Rig
from scenes.pose import Pose
from studio.session.pipeline import SessionInput, SessionMessage

STREAM_ID = "camera-360"
"""The camera's stream in a recording."""

POLL_S = 0.1
"""Seconds after which an end that was asked for is noticed while no picture comes."""


class PacketTap:
    """Outlet for the receiver's packets: nowhere at first, and into a recording once that begins.

    A recording begins at a keyframe of the first track; from that one on pictures may be tracked.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._write: Callable[[EncodedFrame], None] | None = None
        self._first_seq: int | None = None

    @property
    def first_seq(self) -> int | None:
        """Of the first packet that is recorded; None before it."""
        return self._first_seq

    def open(self, write: Callable[[EncodedFrame], None]) -> None:
        """Record from the next keyframe on; `write` must not wait."""
        with self._lock:
            self._write = write

    def put(self, value: EncodedFrame) -> None:
        """Take a packet of the receiver.

        Raises:
            StreamFullError, StreamClosedError: as `write`.
        """
        with self._lock:
            write = self._write
            if write is None:
                return
            if self._first_seq is None:
                if not value.keyframe or value.stream_id != STREAM_ID:
                    return
                self._first_seq = value.seq
        write(value)

    def close(self) -> None:
        """Record no more."""
        with self._lock:
            self._write = None


@dataclass(frozen=True, slots=True, eq=False)
class PictureTimes:
    """When one picture went through the first stages, session time in ns.

    Attributes:
        pts_ns: the camera's own time of it; None where its stream has none.
        captured_ns: that time on the session's clock, known but for the shortest time that the way
            to us takes; None where the stream has no time or too little was seen of its clock.
        arrived_ns: its last byte.
        decoded_ns: its planes.
        taken_ns: when the tracker was ready for it.
        made_ns: its lens pictures.
    """

    pts_ns: int | None
    captured_ns: int | None
    arrived_ns: int
    decoded_ns: int
    taken_ns: int
    made_ns: int

    def stages(self) -> dict[str, int]:
        """Durations in ns by stage; `way` is what the picture took longer than the fastest."""
        way = {} if self.captured_ns is None else {"way": self.arrived_ns - self.captured_ns}
        return way | {
            "decode": self.decoded_ns - self.arrived_ns,
            "wait": self.taken_ns - self.decoded_ns,
            "lens pictures": self.made_ns - self.taken_ns,
        }

    def stages_until(self, tracked_ns: int) -> dict[str, int]:
        """Durations in ns of all stages of a picture whose poses were there at `tracked_ns`."""
        whole = tracked_ns - (self.captured_ns or self.arrived_ns)
        return self.stages() | {"track": tracked_ns - self.made_ns, "whole": whole}


class CameraFrames:
    """Hands out what a receiver has newest, as frames of a rig at a pose.

    Args:
        receiver: of the camera.
        rig: its lenses, for the lens pictures that `stream` gives.
        stream: how its pictures become lens pictures.
        clock: session time.
        tap: where its packets go.

    Attributes:
        world_from_rig: the camera's pose, written into frames from now on; any thread may set it.
        times: of the picture that was handed out last.
    """

    def __init__(
        self,
        receiver: CameraReceiver,
        rig: Rig,
        stream: LiveStream,
        *,
        clock: Clock,
        tap: PacketTap,
        world_from_rig: Pose,
    ) -> None:
        self.world_from_rig = world_from_rig
        self.times: PictureTimes | None = None
        self._receiver = receiver
        self._rig = rig
        self._stream = stream
        self._clock = clock
        self._tap = tap
        self._mapping = ClockMapping()
        self._ended = threading.Event()

    @property
    def camera_clock(self) -> ClockEstimate | None:
        """The camera's clock on the session's; None before enough was seen of it."""
        return estimate(self._mapping)

    def end(self) -> None:
        """No more messages; any thread."""
        self._ended.set()

    def messages(
        self, more: Callable[[], tuple[Event, ...]], record: Callable[[EncodedFrame], None]
    ) -> Iterator[SessionMessage]:
        """Messages until `end`, or until the receiver stops by itself.

        Args:
            more: events of the session since the message before.
            record: takes every packet from the first keyframe on; must not wait.
        """
        self._tap.open(record)
        try:
            yield from self._messages(more)
        finally:
            self._tap.close()

    def _messages(self, more: Callable[[], tuple[Event, ...]]) -> Iterator[SessionMessage]:
        waiting: list[Event] = []
        while not self._ended.is_set():
            # Asked before taking: what came before the end is still taken.
            over = self._receiver.latest.closed
            received = self._receiver.latest.take(timeout_s=POLL_S)
            waiting += self._receiver.take_events()
            if received is None:
                if over:
                    return
                continue
            first = self._tap.first_seq
            if first is None or received.seq < first or not self._fits(received):
                continue
            yield self._message(received, (*waiting, *more()))
            waiting.clear()

    def _fits(self, received: Received) -> bool:
        """Whether the picture is of the kind that the session began with."""
        return len(received.pictures) == self._stream.tracks

    def _message(self, received: Received, events: tuple[Event, ...]) -> SessionMessage:
        taken_ns = self._clock.now_ns()
        images = stream_images(received.pictures, self._stream)
        self.times = PictureTimes(
            received.pts_ns,
            self._captured_ns(received),
            received.t_ns,
            received.decoded_ns,
            taken_ns,
            self._clock.now_ns(),
        )
        frame = Frame(
            stream_id=STREAM_ID,
            seq=received.seq,
            t_ns=received.t_ns,
            received_ns=received.decoded_ns,
            images=images,
            rig=self._rig,
            world_from_rig=self.world_from_rig,
        )
        return SessionMessage(SessionInput(frame, None, events=events))

    def _captured_ns(self, received: Received) -> int | None:
        """When the picture was taken, on the session's clock; never after its arrival."""
        if received.pts_ns is None:
            return None
        self._mapping = add_arrival(self._mapping, received.pts_ns, received.t_ns)
        clock = self.camera_clock
        return None if clock is None else min(clock.session_ns(received.pts_ns), received.t_ns)


def measured_fps(receiver: CameraReceiver) -> float:
    """Return a camera's pictures a second so far; 30 where too few came to say."""
    status, last = receiver.status(), receiver.last
    if last is None or status.pictures < 10 or last.t_ns <= 0:
        return 30.0
    return min(max(status.pictures / (last.t_ns / 1e9), 1.0), 240.0)
