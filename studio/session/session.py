"""A session that runs: each frame is tracked, shown and recorded."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from devices.clock import Clock
from devices.messages import EncodedFrame, Event
from devices.recorded.people import (
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedSurface,
    recorded_thing,
)
from devices.recording import Recorder
from devices.recording_codec import RecordedTrack, RecordedValue
from devices.session_info import SessionInfo
from devices.streams import BoundedQueue
from scenes.package import ScenePackage
from scenes.state import AvatarGone, LiveSurface, SceneState, Shared, reduce_state
from studio.session.latency import Latencies
from studio.session.live_surfaces import LiveSurfaces
from studio.session.pipeline import (
    Executor,
    RecorderThread,
    SessionInput,
    SessionMessage,
)
from studio.session.plan import Pace, SessionPlan
from studio.session.records.cut_short import cut_short_event
from studio.session.records.live_recording import LiveRecording
from studio.session.trackers.camera_events import camera_events
from studio.session.trackers.methods import TruthDetector
from studio.session.trackers.pacing import InFrames, Pacing, stamp_of
from studio.session.trackers.settings import TrackerSettings, settings_event
from studio.view.surface_drawing import LivePicture
from tracking.options import TrackerOptions
from tracking.output import TrackingMethod, TrackOutput

log = logging.getLogger(__name__)

COMMANDS = 64
"""Requests of users that may wait for a session."""
LINES = 1024
"""Drawn lines, and ends of avatars, that may wait while a frame is tracked: a line that grows comes
once a frame."""


@dataclass(frozen=True, slots=True, eq=False)
class SessionOutput:
    """Results of one frame.

    Attributes:
        message: the frame, what came with it, and what rode beside it.
        tracks: every method's answer.
        state: the live room after it.
        surfaces: what its live surfaces show.
        now_ns: session time when it was ready.
        trial: what the first method gives with the settings that are tried; None if none are.
    """

    message: SessionMessage
    tracks: Mapping[str, TrackOutput]
    state: SceneState
    surfaces: tuple[LivePicture, ...]
    now_ns: int
    trial: TrackOutput | None = None

    @property
    def input(self) -> SessionInput:
        """The frame and what came with it."""
        return self.message.input

    @property
    def shown(self) -> TrackOutput:
        """The answer of the first method, which the state follows."""
        return next(iter(self.tracks.values()))


@dataclass(frozen=True, slots=True, eq=False)
class SessionResult:
    """How a session went.

    Attributes:
        frames: pictures that were tracked.
        dropped: pictures that were not, because the tracker was busy.
        lost: pictures that never came from the camera.
        latencies: durations per stage.
        video_shed: packets that the recorder had no room for.
        cut_short: what the recording says of its end if it was stopped before it; None if not.
    """

    frames: int
    dropped: int
    lost: int
    latencies: Latencies
    video_shed: int
    cut_short: Event | None = None


class Session:
    """One run of a scene. Made by `open_session`."""

    def __init__(
        self,
        plan: SessionPlan,
        scene: ScenePackage,
        info: SessionInfo,
        messages: Callable[[], Iterator[SessionMessage]],
        methods: Mapping[str, TrackingMethod[Any]],
        *,
        duration_ns: int,
        clock: Clock,
        executor: Executor,
        truth_detector: TruthDetector | None = None,
        pacing: Pacing | None = None,
    ) -> None:
        self.plan = plan
        self.scene = scene
        self.info = info
        self.duration_ns = duration_ns
        self._messages = messages
        self._clock = clock
        self._executor = executor
        self._truth_detector = truth_detector
        self._pacing = pacing or InFrames()
        self._is_live = plan.pace is Pace.LIVE
        self._latencies = Latencies()
        self._methods = dict(methods)
        self._states: dict[str, Any] = {name: m.start() for name, m in self._methods.items()}
        self._scene_state = SceneState()
        self._live_surfaces = LiveSurfaces(scene)
        self._made_live: BoundedQueue[LiveSurface] = BoundedQueue(COMMANDS, name="commands")
        self._drawn: BoundedQueue[Shared | AvatarGone] = BoundedQueue(LINES, name="annotations")
        self._settings = TrackerSettings(self._methods, plan.options)
        self._frames = self._lost = 0
        self._next_seq = 0
        self._first_seq: int | None = None
        self._last_ns = 0
        self._cut_short: Event | None = None
        self._is_located = False
        # A live camera's receiver replaces pictures that nobody takes; a simulated one sends all.
        self._gaps_are_drops = info.stream is not None
        self._write: Callable[[RecordedValue], None] = _discard
        self._live_recording: LiveRecording | None = None

    @property
    def latencies(self) -> Latencies:
        """Durations so far."""
        return self._latencies

    @property
    def counts(self) -> tuple[int, int, int]:
        """Pictures so far: tracked, waiting or dropped, and those that never came."""
        taken = self._next_seq - (self._first_seq or 0)
        return self._frames, max(taken - self._lost - self._frames, 0), self._lost

    @property
    def recording_failure(self) -> str:
        """Why nothing is recorded any more, in a sentence; empty while all is well."""
        return "" if self._live_recording is None else self._live_recording.failure

    def make_live(self, surface: LiveSurface) -> None:
        """Show live video on a surface from the next frame on; any thread may ask.

        Raises:
            StreamFullError: more was asked for than the session could take.
        """
        self._made_live.put(surface)

    def adjust_tracker(self, options: TrackerOptions) -> None:
        """Track with other settings from the next frame on, recorded; any thread may ask.

        Raises:
            StreamFullError: more was asked for than the session could take.
        """
        self._settings.ask(options)

    def try_tracker(self, options: TrackerOptions | None) -> None:
        """Track with other settings beside, from the state of the next frame on; None ends it.

        Any thread may ask. What is shown and recorded stays as it is; a frame takes twice as long.
        """
        self._settings.try_out(options)

    def record_packet(self, packet: EncodedFrame) -> None:
        """Record what a live camera sent; any thread, never waits for the disk.

        Raises:
            StreamFullError: the disk is too slow.
            StreamClosedError: recording has stopped.
        """
        if self._live_recording is not None:
            self._live_recording.offer(packet)

    def run(
        self,
        watch: Callable[[SessionOutput], None],
        *,
        cancelled: threading.Event | None = None,
        stopped: threading.Event | None = None,
    ) -> SessionResult:
        """Play it from beginning to end, once.

        Args:
            watch: sees every result, on the caller's thread.
            cancelled: set it from another thread to stop and keep nothing.
            stopped: set it from another thread to end it after the frame that is being played; what
                was recorded until then is whole and says so.

        Raises:
            CancelledError: it was cancelled; the recording keeps its `.part` name.
            ValueError, OSError: an input is bad, or the disk is full.
        """
        recorder: Recorder | LiveRecording | None = None
        with ExitStack() as stack:
            stack.callback(self._pacing.close)
            if self.plan.record_to is not None:
                recorder = self._recorded(self.plan.record_to, stack)
            dropped = self._executor.run(
                partial(self._timed_messages, stopped or threading.Event()),
                entered=self._enter,
                step=lambda message: watch(self._step(message)),
                cancelled=cancelled or threading.Event(),
            )
            cut_short = self._cut_short
            if cut_short is not None:
                self._write(cut_short)
        shed = recorder.shed_video if recorder is not None else 0
        if self._gaps_are_drops:
            dropped = self.counts[1]
        return SessionResult(self._frames, dropped, self._lost, self._latencies, shed, cut_short)

    def _recorded(self, path: Path, stack: ExitStack) -> Recorder | LiveRecording:
        """Record from now on until the stack is left."""
        if self.plan.pace is Pace.LIVE:
            self._live_recording = stack.enter_context(LiveRecording(path, self.info))
            self._write = self._live_recording.write
            return self._live_recording
        recorder = stack.enter_context(Recorder(path, self.info))
        self._write = recorder.write
        if self.plan.pace is Pace.PACED:
            self._write = stack.enter_context(RecorderThread(recorder)).write
        return recorder

    def _timed_messages(self, stopped: threading.Event) -> Iterator[SessionMessage]:
        messages = self._messages()
        while True:
            if stopped.is_set():
                self._cut_short = cut_short_event(self._last_ns, self.duration_ns)
                return
            started = time.perf_counter_ns()
            message = next(messages, None)
            if message is None:
                return
            self._latencies.add({"source": time.perf_counter_ns() - started})
            yield message

    def _step(self, message: SessionMessage) -> SessionOutput:
        outputs: dict[str, TrackOutput] = {}
        if self._truth_detector is not None and message.truth is not None:
            self._truth_detector.see(message.frame, message.truth)
        # Before the camera was found once, nobody can say where anything is.
        self._is_located = self._is_located or message.frame.world_from_rig is not None
        message = self._adjusted(message)
        trial = None
        if self._is_located:
            trial = self._settings.tried(self._states, message.frame, self._clock.now_ns())
        self._pacing.begin(message.stamp)
        for place, (name, method) in enumerate(self._methods.items()):
            if not self._is_located:
                outputs[name] = TrackOutput(())
                continue
            started = time.perf_counter_ns()
            self._states[name], output = method.step(
                self._states[name], message.frame, self._clock.now_ns()
            )
            whole = {"track": time.perf_counter_ns() - started}
            self._latencies.add({**output.stage_ns, **whole}, prefix=name if place else "")
            outputs[name] = output
        if self.plan.fork is not None:
            self.plan.fork.check_tracks(message, outputs)
        if (stamp := self._pacing.stamp(message.frame)) is not None:
            self._write(stamp)
        self._record_tracks(outputs)
        shown = outputs[self.plan.methods[0]]
        message = self._noted(message, shown)
        live = message.input
        for change in chain(
            shown.objects, live.avatars, self._new_lines(), self._new_surfaces(live)
        ):
            self._scene_state = reduce_state(self._scene_state, change, live.frame.t_ns)
        surfaces = self._seen_surfaces(live, shown)
        self._frames += 1
        now_ns = self._clock.now_ns()
        return SessionOutput(message, outputs, self._scene_state, surfaces, now_ns, trial)

    def _adjusted(self, message: SessionMessage) -> SessionMessage:
        """Change the tracker's settings as was asked for; the message says so, too."""
        live = message.input
        events = live.events
        for options in self._settings.apply(self._states):
            event = settings_event(live.frame.t_ns, options)
            self._write(event)
            events = events if event in events else (*events, event)
        return replace(message, input=replace(live, events=events))

    def _noted(self, message: SessionMessage, shown: TrackOutput) -> SessionMessage:
        """The message with what the shown tracker says of where the camera stands, recorded."""
        live = message.input
        said = camera_events(live.frame.t_ns, shown.notices)
        for event in said:
            self._write(event)
        return replace(message, input=replace(live, events=(*live.events, *said)))

    def _new_lines(self) -> Iterator[Shared | AvatarGone]:
        """Return things put into the room, and avatars ended, since the last tracked frame."""
        while (line := self._drawn.take()) is not None:
            yield line

    def _new_surfaces(self, live: SessionInput) -> list[LiveSurface]:
        """Record and return the surfaces that became live since the last frame."""
        found: list[LiveSurface] = []
        while (surface := self._made_live.take()) is not None:
            self._write(RecordedSurface(live.frame.t_ns, surface))
            found.append(surface)
        return found

    def _seen_surfaces(self, live: SessionInput, shown: TrackOutput) -> tuple[LivePicture, ...]:
        surfaces = self._scene_state.surfaces
        if not surfaces:
            return ()
        started = time.perf_counter_ns()
        pictures = self._live_surfaces.step(live.frame, surfaces, shown)
        self._latencies.add({"surfaces": time.perf_counter_ns() - started})
        return pictures

    def _enter(self, message: SessionMessage) -> None:
        live, frame = message.input, message.frame
        if self._first_seq is None:
            self._first_seq = frame.seq if self._gaps_are_drops else 0
        if not self._gaps_are_drops:
            self._lost += frame.seq - self._next_seq
        self._next_seq = frame.seq + 1
        self._last_ns = frame.t_ns
        for event in live.events:
            if not self._settings.take(event):  # those are written when they are followed
                self._write(event)
        if not self._is_live:
            known = message.stamp
            self._write(
                stamp_of(frame)
                if known is None
                else stamp_of(
                    frame,
                    known.steps_ms,
                    search_ended=known.search_ended,
                    look_ended=known.look_ended,
                )
            )
        if live.packet is not None:
            self._write(live.packet)
        for avatar in live.avatars:
            self._write(RecordedAvatar(frame.t_ns, avatar))
        things = (*live.annotations, *live.placed)
        for thing in things:
            self._write(recorded_thing(frame.t_ns, thing))
        for gone in live.gone:
            self._write(RecordedAvatarGone(frame.t_ns, gone))
        for voice in live.voices:
            self._write(voice)
        if message.truth is not None:
            self._write(message.truth.recorded)
        # A frame may be dropped on its way to the stages, what came with it once may not.
        for change in (*things, *live.gone):
            self._drawn.put(change)
        for surface in live.surfaces:
            self.make_live(surface)

    def _record_tracks(self, outputs: Mapping[str, TrackOutput]) -> None:
        for name, output in outputs.items():
            for track in output.objects:
                self._write(RecordedTrack(name, track))


def _discard(_value: RecordedValue) -> None:
    """Drop a message: nothing is recorded."""
