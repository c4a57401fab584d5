"""A live session from the camera's first picture to its end; commands come from any thread."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from devices.camera.lenses.layout import LensLayout
from devices.camera.received import Received
from devices.camera.receiver import CameraReceiver
from devices.clock import Clock
from devices.insta360.condition import watch_condition
from devices.messages import Event
from devices.session_info import SessionInfo
from scenes.memory import return_free_pages
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.renderer import Renderer
from scenes.state import LiveSurface
from studio.live.approach import Approach
from studio.live.camera_frames import STREAM_ID, CameraFrames, PacketTap, PictureTimes, measured_fps
from studio.live.changes import Changes
from studio.live.hololens.worn import WornHeadset
from studio.live.people.entering import Entrance, People
from studio.live.people.pictures import SurfacePictures
from studio.live.placing import Locate, Placed, PlacedCamera, place_camera
from studio.live.relocation import Lookout, Relocation
from studio.live.setup import LiveSetup
from studio.live.shortfalls import Losses
from studio.live.status import Journal, LiveResult, LiveState, LiveStatus
from studio.session.latency import Latencies
from studio.session.opening import open_live_session, scene_hash
from studio.session.pipeline import SessionMessage
from studio.session.plan import Pace, SessionPlan
from studio.session.records.provenance import library_versions
from studio.session.session import Session, SessionOutput, SessionResult
from tracking.options import TrackerOptions

RETURN_PAGES_EVERY_S = 5.0
"""Seconds between two returns of free memory to the system: some ms of one picture each."""

SHOWN_STAGES = 300
"""Pictures whose durations a window shows: ten seconds at 30 Hz."""


class LiveSession:
    """One camera in one room. `run` plays it on the caller's thread; all else is for any thread.

    Args:
        scene_name: as `open_scene` takes it.
        scene: the room.
        setup: the devices.
        clock: session time.
        renderer: draws splats.
        locate: finds the camera's pose.
        record_to: the recording; None for none.
        asks: whether a person confirms a doubtful layout and says when to go live and to try again;
            without one, the likeliest layout is taken and it goes live as soon as it can.
        people: hub of those who are connected; None where nobody can join.
        worn: headset of the local user, which the session begins and ends; None without one.
    """

    def __init__(
        self,
        scene_name: str,
        scene: ScenePackage,
        setup: LiveSetup,
        *,
        clock: Clock,
        renderer: Renderer,
        locate: Locate,
        record_to: Path | None = None,
        asks: bool = False,
        people: People | None = None,
        worn: WornHeadset | None = None,
    ) -> None:
        self.scene = scene
        self.worn = worn
        self.setup = setup
        self.latencies = Latencies()
        self._scene_name = scene_name
        self._clock = clock
        self._renderer = renderer
        self._locate = locate
        self.record_to = record_to
        """File of the recording; None if there is none."""
        self.tracked: Session | None = None
        """Session that tracks and records; None before the camera is placed."""
        self._asks = asks
        everybody = people if worn is None else worn.people(people)
        self._entrance = None if everybody is None else Entrance(everybody)
        self._pictures = None if people is None else SurfacePictures(people)
        self._ended = threading.Event()
        self._goes_live = threading.Event()
        self._journal = Journal(clock)
        self._changes = Changes(clock)
        self._placed: PlacedCamera | None = None
        self._frames: CameraFrames | None = None
        self._last: SessionOutput | None = None
        self._first_ns = self._live_ns = self._end_ns = self._next_return_ns = 0
        self._first_dropped = 0
        self._relocation = Relocation(
            locate, self._look, done=self._relocated, failed=self._not_relocated
        )
        self._losses = Losses(scene)
        self._tap = PacketTap()
        self._receiver = CameraReceiver(setup.camera, clock, packets=self._tap, stream_id=STREAM_ID)
        self._condition = watch_condition(
            setup.camera, clock, say=lambda text: self._journal.note("battery", text)
        )
        self._approach = Approach(
            self._receiver, setup, place=self._place, journal=self._journal, asks=asks
        )

    def go_live(self) -> None:
        """Go live as soon as the objects are found."""
        self._goes_live.set()

    def end(self) -> None:
        """End the session; `run` returns soon after."""
        self._ended.set()
        self._approach.end()
        if self._frames is not None:
            self._frames.end()

    def choose_layout(self, layout: LensLayout) -> None:
        """The picture holds the lenses like this."""
        self._journal.note("changed", self._changes.add(f"layout: {layout.shown}"))
        self._approach.choose_layout(layout)

    def try_again(self) -> None:
        """Look for the camera again after it was not found."""
        self._approach.try_again()

    def adjust_tracker(self, options: TrackerOptions) -> None:
        """Track with other settings from the next picture on.

        Raises:
            StreamFullError: more was asked for than the session could take.
        """
        if self.tracked is not None:
            self.tracked.adjust_tracker(options)
        self._journal.note("changed", self._changes.adjust(options))

    def undo_adjustment(self) -> bool:
        """Go back to the settings before the last change; False if there is none."""
        said = self._changes.undo()
        if not said:
            return False
        if self.tracked is not None:
            self.tracked.adjust_tracker(self._changes.options)
        self._journal.note("changed", said)
        return True

    def make_live(self, surface: LiveSurface) -> None:
        """Show live video on a surface.

        Raises:
            StreamFullError: more was asked for than the session could take.
            ValueError: nothing is tracked yet.
        """
        if self.tracked is None:
            raise ValueError("live surfaces: wait until the camera is placed")
        self.tracked.make_live(surface)
        self._journal.note("changed", self._changes.add(f"live surface {surface.surface_id}"))

    def relocate(self) -> None:
        """Look for the camera anywhere in the room, beside the running session."""
        self._relocation.start()

    @property
    def options(self) -> TrackerOptions:
        """The tracker's settings now."""
        return self._changes.options

    @property
    def state(self) -> LiveState:
        """As in `status`, at no cost."""
        return self._journal.state

    @property
    def listening_at(self) -> str:
        """As in `status`, at no cost."""
        return self._receiver.listening_at

    @property
    def is_locating(self) -> bool:
        """Whether the camera is looked for beside the running session."""
        return self._relocation.is_running

    @property
    def picture(self) -> Received | None:
        """The camera's newest picture; None before the first."""
        return self._receiver.last

    @property
    def layout(self) -> LensLayout | None:
        """How its picture holds the lenses, as it is used."""
        return self._approach.layout

    @property
    def picture_times(self) -> PictureTimes | None:
        """When the picture that was tracked last went through the first stages."""
        return None if self._frames is None else self._frames.times

    def now_ns(self) -> int:
        """Session time."""
        return self._clock.now_ns()

    def events(self) -> tuple[Event, ...]:
        """Return the events so far, oldest first."""
        return self._journal.events()

    def status(self) -> LiveStatus:
        """How it is doing now."""
        session, last = self.tracked, self._last
        tracks = () if last is None else last.shown.objects
        live_ns = self._live_ns
        return LiveStatus(
            self._journal.state,
            self._journal.text,
            self._receiver.status(),
            self._receiver.listening_at,
            self._approach.found_layout,
            self._placed,
            self.latencies.stages(last=SHOWN_STAGES),
            0 if session is None else session.counts[0],
            self._dropped(),
            dict(Counter(str(track.state) for track in tracks)),
            self._losses.lost,
            (self._clock.now_ns() - live_ns) / 1e9 if live_ns else None,
            "" if session is None else session.recording_failure,
            self._relocation.is_lost,
            None if self._frames is None else self._frames.camera_clock,
            None if self._condition is None else self._condition.last,
            None if self.worn is None else self.worn.status(),
        )

    def _dropped(self) -> int:
        """Pictures left out so far, but for those of the first search for objects."""
        return 0 if self.tracked is None else self.tracked.counts[1] - self._first_dropped

    def run(self, watch: Callable[[SessionOutput], None]) -> LiveResult:
        """Play it to its end.

        Args:
            watch: sees every result, on this thread.

        Raises:
            PlacingError: the camera is not found and nobody is asked.
            ValueError, OSError: an input is bad.
        """
        result: SessionResult | None = None
        if self.worn is not None:
            self.worn.start(self._carried)
        try:
            placed = self._approach.run()
            if placed is not None:
                result = self._track(placed, watch)
        finally:
            self._end_ns = self._clock.now_ns()
            self._tap.close()
            camera = self._receiver.status()
            self._receiver.close()
            for part in (self._condition, self._pictures, self.worn):
                if part is not None:
                    part.close()
            self._journal.say(LiveState.ENDED, "the session has ended")
        since = self._first_ns or self._end_ns
        return LiveResult(
            result,
            camera,
            placed,
            (self._end_ns - since) / 1e9,
            (self._end_ns - self._live_ns) / 1e9 if self._live_ns else 0.0,
            self.events(),
            self._changes.kept(),
            self.latencies,
            self.record_to,
            "" if self.tracked is None else self.tracked.recording_failure,
            self._dropped(),
        )

    def _place(self, pictures: list[Received], layout: LensLayout) -> PlacedCamera:
        return place_camera(
            pictures,
            layout,
            *(self.setup, self.scene),
            renderer=self._renderer,
            locate=self._locate,
            say=lambda text: self._journal.say(LiveState.PLACING, text),
            carried=self._receiver.carried_lenses(),
        )

    def _track(self, placed: PlacedCamera, watch: Callable[[SessionOutput], None]) -> SessionResult:
        self._placed = placed
        self._journal.note("camera-placed", placed.found)
        plan = SessionPlan(
            scene=self._scene_name, methods=("own",), pace=Pace.LIVE, record_to=self.record_to
        )
        info = SessionInfo(
            scene=self._scene_name,
            scene_hash=scene_hash(self.scene),
            seed=None,
            scenario="",
            scenario_name="",
            mode=str(Pace.LIVE),
            methods=plan.methods,
            versions=library_versions(),
            rig=placed.rig,
            fps=measured_fps(self._receiver),
            stream=placed.stream,
        )
        frames = CameraFrames(
            self._receiver,
            placed.rig,
            placed.stream,
            clock=self._clock,
            tap=self._tap,
            world_from_rig=placed.world_from_rig,
        )
        self._frames = frames
        session = open_live_session(
            plan,
            self.scene,
            info,
            lambda: self._entered(frames.messages(self._journal.take_notes, session.record_packet)),
            self._clock,
        )
        if self._changes.options != TrackerOptions():
            session.adjust_tracker(self._changes.options)
        self.tracked = session
        self._journal.say(LiveState.FINDING, "finding the objects")
        if self._ended.is_set():
            frames.end()
        return session.run(lambda output: self._watched(output, watch))

    def _entered(self, messages: Iterator[SessionMessage]) -> Iterator[SessionMessage]:
        """Return the camera's messages with what people have sent."""
        return messages if self._entrance is None else map(self._entrance.enter, messages)

    def _watched(self, output: SessionOutput, watch: Callable[[SessionOutput], None]) -> None:
        frames = self._frames
        assert frames is not None
        if self._entrance is not None:
            self._entrance.publish(output.state)
        if self.worn is not None and output.shown.world_from_rig is not None:
            self.worn.see_camera(output.shown.world_from_rig)
        if self._pictures is not None:
            self._pictures.show(output.surfaces, output.now_ns)
        self._journal.add(output.input.events)
        if frames.times is not None and self._last is not None:
            # The first picture's search is nobody's delay.
            self.latencies.add(frames.times.stages_until(output.now_ns))
        self._relocation.notice(output.shown.notices, output.now_ns)
        lost = self._relocation.is_lost
        for words in self._losses.notice(
            output.shown.objects, dropped=self._dropped(), is_camera_lost=lost
        ):
            self._journal.note("lost", words)
        if self._last is None:
            self._first_ns = output.now_ns
            self._first_dropped = 0 if self.tracked is None else self.tracked.counts[1]
            self._journal.say(LiveState.READY, "objects found: go live")
        self._last = output
        if self._journal.state is LiveState.READY and (self._goes_live.is_set() or not self._asks):
            self._live_ns = self._clock.now_ns()
            self._journal.note("live", "the session is live")
            self._journal.say(LiveState.LIVE, "live")
        if output.now_ns >= self._next_return_ns:
            self._next_return_ns = output.now_ns + round(RETURN_PAGES_EVERY_S * 1e9)
            return_free_pages()
        watch(output)

    def _look(self) -> Lookout | None:
        placed, received, output = self._placed, self._receiver.last, self._last
        if placed is None or received is None:
            return None
        return Lookout(received, placed, None if output is None else output.shown.world_from_rig)

    def _relocated(self, found: Placed) -> None:
        placed, frames = self._placed, self._frames
        if found.refusal or placed is None or frames is None:
            self._not_relocated(found.refusal)
            return
        frames.world_from_rig = found.world_from_rig
        self._placed = replace(placed, world_from_rig=found.world_from_rig)
        self._journal.note("camera-placed", found.described())

    def _carried(self, world_from_rig: Pose) -> None:
        """Look for the camera where its code is seen."""
        if self._frames is not None and self._placed is not None:
            self._frames.world_from_rig = world_from_rig
            self._placed = replace(self._placed, world_from_rig=world_from_rig)

    def _not_relocated(self, why: str) -> None:
        self._journal.note("camera-refused", f"the camera was not found: {why}")
