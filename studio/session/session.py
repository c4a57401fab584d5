"""The composition root: `open_session` puts adapters, clock, executor and recorder together."""

from __future__ import annotations

import hashlib
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from devices.clock import Clock, ManualClock, WallClock
from devices.recording import Recorder, read_session
from devices.recording_codec import (
    FrameStamp,
    RecordedAnnotation,
    RecordedAvatar,
    RecordedSurface,
    RecordedTrack,
    RecordedValue,
)
from devices.session_info import SessionInfo
from devices.streams import BoundedQueue
from scenes.package import ScenePackage
from scenes.state import Annotation, LiveSurface, SceneState, reduce_state
from sim.faults.fault import Fault
from studio.session.fork import Fork
from studio.session.latency import Latencies
from studio.session.live_surfaces import LiveSurfaces
from studio.session.methods import METHODS, NO_MORE, MethodMaker, TruthDetector, make_method
from studio.session.pipeline import ExactExecutor, Executor, PacedExecutor, RecorderThread
from studio.session.recorded_scene import recorded_scene, with_camera
from studio.session.sources import (
    SessionInput,
    SessionMessage,
    recorded_messages,
    simulated_messages,
)
from studio.session.tracker_settings import TrackerSettings, settings_event
from studio.view.surface_drawing import LivePicture
from tracking.hypotheses.budget import NOMINAL_COSTS, MeasuredCosts
from tracking.options import TrackerOptions
from tracking.output import TrackingMethod, TrackOutput

log = logging.getLogger(__name__)

COMMANDS = 64
"""What users may have asked for and a session has not yet done."""
LINES = 1024
"""What may have been drawn while a frame is tracked: a line that grows comes once a frame."""


class Pace(StrEnum):
    """How time passes in a session."""

    EXACT = "exact"
    """On one thread, nothing dropped, as fast as it goes: the same every time."""
    PACED = "paced"
    """In real time: frames that come while the tracker is busy are dropped and counted."""


@dataclass(frozen=True, slots=True)
class SessionPlan:
    """What a session is made of.

    Attributes:
        scene: name of a built-in room or path of a scene package; ignored by a replay.
        scenario: name or path of a scenario, or None for the scene's own; ignored by a replay.
        seed: of everything random in the simulation.
        recording: a recording to play instead of simulating.
        methods: trackers to run, of `METHODS` and `more_methods`; the first is shown.
        pace: how time passes.
        record_to: where to write the recording, or None.
        fork: a recorded simulation to go on with; its scene, seed and methods are given above.
        more_methods: trackers beside `METHODS` by name, such as those of plug-ins.
        more_faults: kinds that the scenario may have beside the built-in ones.
        options: the tracker's settings to begin with; None for the usual ones, and in a replay for
            those that are recorded, with their changes.
    """

    scene: str = "lab"
    scenario: str | None = None
    seed: int = 0
    recording: Path | None = None
    methods: tuple[str, ...] = METHODS
    pace: Pace = Pace.EXACT
    record_to: Path | None = None
    fork: Fork | None = None
    more_methods: Mapping[str, MethodMaker] = field(default_factory=lambda: NO_MORE)
    more_faults: tuple[type[Fault], ...] = ()
    options: TrackerOptions | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SessionOutput:
    """What one frame led to.

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
    """

    frames: int
    dropped: int
    lost: int
    latencies: Latencies
    video_shed: int


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
    ) -> None:
        self.plan = plan
        self.scene = scene
        self.info = info
        self.duration_ns = duration_ns
        self._messages = messages
        self._clock = clock
        self._executor = executor
        self._truth_detector = truth_detector
        self._latencies = Latencies()
        self._methods = dict(methods)
        self._states: dict[str, Any] = {name: m.start() for name, m in self._methods.items()}
        self._scene_state = SceneState()
        self._live_surfaces = LiveSurfaces(scene)
        self._made_live: BoundedQueue[LiveSurface] = BoundedQueue(COMMANDS, name="commands")
        self._drawn: BoundedQueue[Annotation] = BoundedQueue(LINES, name="annotations")
        self._settings = TrackerSettings(self._methods, plan.options)
        self._frames = self._lost = 0
        self._next_seq = 0
        self._is_located = False
        self._write: Callable[[RecordedValue], None] = _discard

    @property
    def latencies(self) -> Latencies:
        """Durations so far."""
        return self._latencies

    @property
    def counts(self) -> tuple[int, int, int]:
        """Pictures so far: tracked, waiting or dropped, and those that never came."""
        return self._frames, max(self._next_seq - self._lost - self._frames, 0), self._lost

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

    def run(
        self,
        watch: Callable[[SessionOutput], None],
        *,
        cancelled: threading.Event | None = None,
    ) -> SessionResult:
        """Play it from beginning to end, once.

        Args:
            watch: sees every result, on the caller's thread.
            cancelled: set it from another thread to stop.

        Raises:
            CancelledError: it was cancelled; the recording keeps its `.part` name.
            ValueError, OSError: an input is bad, or the disk is full.
        """
        recorder: Recorder | None = None
        with ExitStack() as stack:
            if self.plan.record_to is not None:
                recorder = stack.enter_context(Recorder(self.plan.record_to, self.info))
                self._write = recorder.write
                if self.plan.pace is Pace.PACED:
                    self._write = stack.enter_context(RecorderThread(recorder)).write
            dropped = self._executor.run(
                self._timed_messages,
                entered=self._enter,
                step=lambda message: watch(self._step(message)),
                cancelled=cancelled or threading.Event(),
            )
        shed = recorder.shed_video if recorder is not None else 0
        return SessionResult(self._frames, dropped, self._lost, self._latencies, shed)

    def _timed_messages(self) -> Iterator[SessionMessage]:
        messages = self._messages()
        while True:
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
        self._record_tracks(outputs)
        shown = outputs[self.plan.methods[0]]
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

    def _new_lines(self) -> Iterator[Annotation]:
        """What has been drawn since the last frame that was tracked."""
        while (line := self._drawn.take()) is not None:
            yield line

    def _new_surfaces(self, live: SessionInput) -> list[LiveSurface]:
        """What has become live since the last frame, recorded."""
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
        self._lost += frame.seq - self._next_seq
        self._next_seq = frame.seq + 1
        for event in live.events:
            if not self._settings.take(event):  # those are written when they are followed
                self._write(event)
        stamp = FrameStamp(
            frame.stream_id, frame.seq, frame.t_ns, frame.received_ns, frame.world_from_rig
        )
        self._write(stamp)
        self._write(live.packet)
        for avatar in live.avatars:
            self._write(RecordedAvatar(frame.t_ns, avatar))
        for line in live.annotations:
            self._write(RecordedAnnotation(frame.t_ns, line))
        if message.truth is not None:
            self._write(message.truth.recorded)
        # A frame may be dropped on its way to the stages, what came with it once may not.
        for line in live.annotations:
            self._drawn.put(line)
        for surface in live.surfaces:
            self.make_live(surface)

    def _record_tracks(self, outputs: Mapping[str, TrackOutput]) -> None:
        for name, output in outputs.items():
            for track in output.objects:
                self._write(RecordedTrack(name, track))


def open_session(plan: SessionPlan, *, truth_detector: TruthDetector | None = None) -> Session:
    """Choose adapters, clock, executor and recorder, and put them together.

    Args:
        plan: what to play.
        truth_detector: finds the objects for the paper's method in a simulation; without one, the
            method finds what differs from the empty room.

    Raises:
        ValueError: the scene, scenario or recording is bad, or a method is unknown.
        OSError: a file cannot be opened.
    """
    known = (*METHODS, *plan.more_methods)
    unknown = [name for name in plan.methods if name not in known]
    if unknown or not plan.methods:
        raise ValueError(f"tracking method {unknown}: wanted some of {', '.join(known)}")
    clock: Clock = ManualClock() if plan.pace is Pace.EXACT else WallClock()
    executor = ExactExecutor(clock) if plan.pace is Pace.EXACT else PacedExecutor(clock)
    made = _recorded(plan) if plan.recording is not None else _simulated(plan)
    scene, info, messages, duration_ns = made
    # Measured costs differ from run to run, and with them the frames in which searches end.
    is_exact = plan.pace is Pace.EXACT
    costs = NOMINAL_COSTS if is_exact else MeasuredCosts(time.perf_counter_ns)
    methods = {
        name: make_method(
            name,
            scene,
            truth_detector,
            stopwatch=time.perf_counter_ns,
            costs=costs,
            more=plan.more_methods,
        )
        for name in plan.methods
    }
    return Session(
        plan,
        scene,
        info,
        messages,
        methods,
        duration_ns=duration_ns,
        clock=clock,
        executor=executor,
        truth_detector=truth_detector,
    )


def scene_hash(scene: ScenePackage) -> str:
    """A digest of everything the tracker takes from a scene: splats, poses, boxes."""
    digest = hashlib.sha256()
    clouds = [("room", scene.room), *((o.object_id, o.splats) for o in scene.objects)]
    for name, cloud in clouds:
        digest.update(name.encode())
        for array in (cloud.means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh):
            digest.update(array.tobytes())
    for item in scene.objects:
        numbers = [*item.box_m, item.support_z_m]
        digest.update(np.array(numbers, dtype=np.float64).tobytes())
        digest.update(item.world_from_object.matrix().tobytes())
    return digest.hexdigest()


Made = tuple[ScenePackage, SessionInfo, Callable[[], Iterator[SessionMessage]], int]


def _simulated(plan: SessionPlan) -> Made:
    from sim.camera.camera360 import default_rig
    from studio.session.provenance import library_versions
    from studio.session.staging import staging_of

    fork = plan.fork
    staging = staging_of(plan.scene, plan.scenario, fork, more_faults=plan.more_faults)
    scenario = staging.scenario
    scene = with_camera(staging.scene, scenario.camera.world_from_rig)
    then = () if fork is None else fork.then
    info = SessionInfo(
        scene=plan.scene,
        scene_hash=scene_hash(scene),
        seed=plan.seed,
        scenario=staging.scenario_text,
        scenario_name=scenario.name,
        mode=str(plan.pace),
        methods=plan.methods,
        versions=library_versions(),
        rig=default_rig(scenario.camera.lens_size_px),
        fps=scenario.camera.fps,
        changes=() if fork is None else fork.changes,
        fork=None if fork is None else fork.origin,
        reality=staging.reality,
    )
    if fork is not None:
        fork.check_scene(info.scene_hash)
    steps = staging.steps(plan.seed, then)
    corners = {item.surface_id: np.array(item.corners_in_world) for item in scenario.surfaces}
    duration_ns = round((then[-1].scenario if then else scenario).duration_s * 1e9)

    def messages() -> Iterator[SessionMessage]:
        simulated = simulated_messages(steps(), corners)
        return simulated if fork is None else fork.proven(simulated)

    return scene, info, messages, duration_ns


def _recorded(plan: SessionPlan) -> Made:
    path = plan.recording
    assert path is not None
    if "paper" in plan.methods:
        raise ValueError(
            f"{path}: the paper's method cannot be replayed: it works on the simulator's masks, "
            "which a recording does not hold; rehearse again with the same seed"
        )
    info = read_session(path)
    scene = recorded_scene(info)
    found = scene_hash(scene)
    if found != info.scene_hash:
        raise ValueError(
            f"{path}: recorded with another version of scene {info.scene!r} "
            f"({info.scene_hash[:12]}, here {found[:12]}); tracks cannot be compared"
        )
    # What is recorded now is what is tracked now: every frame, by these methods.
    info = replace(info, methods=plan.methods, mode=str(plan.pace))
    return scene, info, partial(recorded_messages, path, info), 0


def _discard(_value: RecordedValue) -> None:
    """Where messages go when nothing is recorded."""
