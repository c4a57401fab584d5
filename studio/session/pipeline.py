"""Messages of a session, from the simulator, a recording or a camera, on their way to the stages.

They go there exactly, on one thread, or paced by a clock.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from numpy.typing import ArrayLike

from devices.adapter import IteratorDevice, Timed
from devices.clock import Clock
from devices.messages import EncodedFrame, Event, Frame, VoicePacket
from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedPrimitive,
    RecordedProposal,
    RecordedSurface,
    RecordedThing,
)
from devices.recording import Recorder, read_recording
from devices.recording_codec import FrameStamp, RecordedTrack, RecordedTruth, RecordedValue
from devices.replay import FrameAssembler
from devices.session_info import SessionInfo
from devices.streams import BoundedQueue, Slot, StreamClosedError
from scenes.state import Annotation, Avatar, AvatarGone, LiveSurface, Placed, TrackedObject
from scenes.workers.task import Task
from sim.truth import GroundTruth
from studio.session.live_surfaces import live_surface
from studio.session.trackers.camera_events import is_camera_event

if TYPE_CHECKING:
    from sim.rehearsal import SimulatedStep


M = TypeVar("M", bound=Timed)

RECORDER_QUEUE = 1024
"""Messages that may wait for the disk: some ten seconds of a session."""

CANCEL_POLL_S = 0.1
"""How long a paced session may take to notice that it was cancelled."""

Waiting = Event | RecordedSurface | RecordedThing | RecordedAvatarGone
"""Messages between frames of a recording, which enter with the next one."""

PEOPLE = "people"
"""Source of events of people who are connected."""

Corners = Mapping[str, ArrayLike]
"""(4, 3) corners in the world by surface id."""


class CancelledError(Exception):
    """The user stopped the session."""


class Executor(Protocol):
    """Runs a session's messages through its stages."""

    def run(
        self,
        messages: Callable[[], Iterator[M]],
        *,
        entered: Callable[[M], None],
        step: Callable[[M], None],
        cancelled: threading.Event,
    ) -> int:
        """Take every message to `entered`, and those that are not dropped to `step`.

        Args:
            messages: called once; yields in order of time.
            entered: sees every message, in order; on the adapter's thread.
            step: the stages; on the caller's thread.
            cancelled: set to stop early.

        Returns:
            How many messages were dropped between the two.

        Raises:
            CancelledError: `cancelled` was set.
            Exception: whatever the messages, `entered` or `step` raise.
        """
        ...


class ExactExecutor:
    """One thread, nothing dropped: the same messages always give the same results."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def run(
        self,
        messages: Callable[[], Iterator[M]],
        *,
        entered: Callable[[M], None],
        step: Callable[[M], None],
        cancelled: threading.Event,
    ) -> int:
        """See `Executor.run`; always returns 0."""
        for message in messages():
            if cancelled.is_set():
                raise CancelledError
            self._clock.sleep_until(message.t_ns)
            entered(message)
            step(message)
        return 0


class PacedExecutor:
    """The adapter on its own thread keeps the clock's time; the stages get the latest message."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def run(
        self,
        messages: Callable[[], Iterator[M]],
        *,
        entered: Callable[[M], None],
        step: Callable[[M], None],
        cancelled: threading.Event,
    ) -> int:
        """See `Executor.run`."""
        slot: Slot[M] = Slot()

        def tee() -> Iterator[M]:
            for message in messages():
                entered(message)
                yield message

        device = IteratorDevice("session source", tee)
        device.start(slot, self._clock)
        try:
            while True:
                if cancelled.is_set():
                    raise CancelledError
                ended = slot.closed  # asked before taking: what came before the end is still taken
                message = slot.take(timeout_s=CANCEL_POLL_S)
                if message is not None:
                    step(message)
                elif ended:
                    break
        finally:
            device.stop()
        if device.failure is not None:
            raise device.failure
        return slot.dropped


class RecorderThread:
    """Lets a session write from several threads without waiting for the disk.

    Use as a context manager around the recorder's own.

    Args:
        recorder: written by this object's thread only.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._queue: BoundedQueue[RecordedValue] = BoundedQueue(RECORDER_QUEUE, name="recorder")
        self._failure: Exception | None = None
        self._task = Task("recorder", self._write)

    def write(self, value: RecordedValue) -> None:
        """Hand over one message.

        Raises:
            StreamFullError: the disk is too slow.
            OSError: writing failed earlier.
        """
        try:
            self._queue.put(value, timeout_s=2.0)
        except StreamClosedError:
            if self._failure is not None:
                raise self._failure from None
            raise

    def offer(self, value: RecordedValue) -> None:
        """Hand over one message without waiting.

        Raises:
            StreamFullError: the disk is too slow.
            StreamClosedError: writing failed earlier, or the recording ended.
        """
        self._queue.put(value)

    def _write(self, _task: Task[None]) -> None:
        try:
            while (value := self._queue.take(timeout_s=None)) is not None:
                self._recorder.write(value)
        except (OSError, ValueError) as error:
            self._failure = error
            self._queue.close()

    def __enter__(self) -> RecorderThread:
        self._task.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_rest: object) -> None:
        self._queue.close()
        self._task.join()
        if kind is None and self._failure is not None:
            raise self._failure


@dataclass(frozen=True, slots=True, eq=False)
class SessionInput:
    """One camera frame and everything that came with it: what live devices deliver, too.

    Attributes:
        frame: what the tracker sees.
        packet: the frame as it left the camera; None where packets are recorded as they arrive.
        avatars: people at that time.
        events: what happened since the frame before.
        surfaces: what has become live, moved or been removed since the frame before.
        annotations: lines that have been drawn, have grown or been erased since the frame before.
        gone: avatars that have ended since the frame before.
        placed: primitives and proposals that have been put, changed or taken away since then.
        voices: what people have said since then, to be recorded and for nothing else.
    """

    frame: Frame
    packet: EncodedFrame | None
    avatars: tuple[Avatar, ...] = ()
    events: tuple[Event, ...] = ()
    surfaces: tuple[LiveSurface, ...] = ()
    annotations: tuple[Annotation, ...] = ()
    gone: tuple[AvatarGone, ...] = ()
    placed: tuple[Placed, ...] = ()
    voices: tuple[VoicePacket, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class SessionMessage:
    """A session's input on its way to the stages, and what rides beside it past them.

    Attributes:
        input: what the stages see.
        truth: the simulator's, live or recorded; None of a real camera.
        recorded: tracks of a recording, each with the name of its method; empty unless replayed.
        stamp: of a recorded frame.
    """

    input: SessionInput
    truth: GroundTruth | None = None
    recorded: tuple[tuple[str, TrackedObject], ...] = ()
    stamp: FrameStamp | None = None

    @property
    def frame(self) -> Frame:
        """The input's frame."""
        return self.input.frame

    @property
    def t_ns(self) -> int:
        """Session time at which the input arrives, ns."""
        return self.input.frame.received_ns

    def with_frame(self, frame: Frame) -> SessionMessage:
        """The same message around another frame."""
        return replace(self, input=replace(self.input, frame=frame))


def simulated_messages(
    steps: Iterator[SimulatedStep], corners_of_surfaces: Corners | None = None
) -> Iterator[SessionMessage]:
    """The messages of a simulated session, in order of time.

    Args:
        steps: of the simulator.
        corners_of_surfaces: what is live from the first frame on whose camera pose is known, by
            surface id.
    """
    waiting = dict(corners_of_surfaces or {})
    for step in steps:
        surfaces: tuple[LiveSurface, ...] = ()
        if step.frame.world_from_rig is not None:
            surfaces = tuple(live_surface(key, at, step.frame) for key, at in waiting.items())
            waiting.clear()
        live = SessionInput(
            step.frame, step.packet, step.avatars, step.events, surfaces, step.annotations
        )
        yield SessionMessage(live, step.truth)


def recorded_messages(path: Path, session: SessionInfo) -> Iterator[SessionMessage]:
    """The messages of a recorded session, in order of time.

    Raises:
        RecordingError: the recording is damaged.
        ValueError: a video packet cannot be decoded.
    """
    assembler = FrameAssembler(session)
    same_time: list[RecordedValue] = []
    waiting: list[Waiting] = []
    for value in read_recording(path):
        if same_time and time_ns_of(value) != time_ns_of(same_time[0]):
            yield from _grouped(same_time, assembler, waiting)
            same_time = []
        same_time.append(value)
    yield from _grouped(same_time, assembler, waiting)


def time_ns_of(value: RecordedValue) -> int:
    """The session time of anything recorded."""
    return value.track.t_ns if isinstance(value, RecordedTrack) else value.t_ns


def placed_in(values: Iterable[RecordedValue]) -> tuple[Placed, ...]:
    """The primitives and proposals among recorded values, in order."""
    return tuple(
        value.primitive if isinstance(value, RecordedPrimitive) else value.proposal
        for value in values
        if isinstance(value, RecordedPrimitive | RecordedProposal)
    )


def _grouped(
    values: list[RecordedValue],
    assembler: FrameAssembler,
    waiting: list[Waiting],
) -> Iterator[SessionMessage]:
    """The message that these values of one time make; what comes between frames is `waiting`."""
    waiting += [v for v in values if isinstance(v, Waiting) and not is_camera_event(v)]
    for value in values:
        frame = assembler.feed(value)
        if frame is None or not isinstance(value, EncodedFrame):
            continue
        live = SessionInput(
            frame=frame,
            packet=value,
            avatars=tuple(v.avatar for v in values if isinstance(v, RecordedAvatar)),
            events=tuple(v for v in waiting if isinstance(v, Event)),
            surfaces=tuple(v.surface for v in waiting if isinstance(v, RecordedSurface)),
            annotations=tuple(v.annotation for v in waiting if isinstance(v, RecordedAnnotation)),
            gone=tuple(v.gone for v in waiting if isinstance(v, RecordedAvatarGone)),
            placed=placed_in(waiting),
        )
        truth = next((GroundTruth(v) for v in values if isinstance(v, RecordedTruth)), None)
        tracks = tuple((v.method, v.track) for v in values if isinstance(v, RecordedTrack))
        stamp = next((v for v in values if isinstance(v, FrameStamp)), None)
        yield SessionMessage(live, truth, tracks, stamp)
        waiting.clear()
