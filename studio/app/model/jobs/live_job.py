"""A thread that plays a live session: a camera in, its room's twin out, a report at its end."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from devices.streams import Slot
from scenes.workers.task import Task
from studio.app.model.jobs.scene_job import SceneJob
from tracking.options import TrackerOptions

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from devices.clock import Clock
    from devices.hub.attendance import PageHeadset
    from devices.hub.server import Hub
    from scenes.package import ScenePackage
    from scenes.state import LiveSurface
    from studio.live.hololens.wearing import Wearing
    from studio.live.live import LiveSession
    from studio.live.people.doors import Doors
    from studio.live.people.entering import People
    from studio.live.people.hosting import Hosting
    from studio.live.rehearsed import RehearsedLive
    from studio.live.setup import LiveSetup
    from studio.live.sites.sharing import Sharing
    from studio.live.status import LiveResult
    from studio.session.preflight import Check
    from studio.session.session import Session

CLOSE_S = 5.0
"""Seconds that a window that closes waits for the session: packets are written out in less.
What cannot be interrupted, a search for the camera, records nothing and ends with the program."""

LOOK_S = 0.2
"""Seconds between two looks at the simulated camera and the clock, chosen: nobody notices less."""


@dataclass(frozen=True, slots=True)
class LivePlan:
    """A live session as it was asked for.

    Attributes:
        scene: name or path of the room.
        setup: the devices.
        out: folder of recording, checks and report.
        is_simulated: whether a simulated camera pushes to it, failing as real ones do.
        scenario: what happens before the simulated camera; None for the scene's own.
        seed: of all that is random there.
        seconds: it goes live by itself and ends after so long; None until somebody ends it.
        records: whether it leaves a recording.
        hosting: how people join; None where they cannot.
        sharing: with which sites it is shared; None for none.
        wears: whether the local user wears a HoloLens; a simulated one where the setup has none.
    """

    scene: str
    setup: LiveSetup
    out: Path
    is_simulated: bool = False
    scenario: str | None = None
    seed: int = 0
    seconds: float | None = None
    records: bool = True
    hosting: Hosting | None = None
    sharing: Sharing | None = None
    wears: bool = False


class LiveJob(SceneJob):
    """Opens the room if it is not open, and plays the session; nothing here touches a widget.

    Args:
        plan: what to play.
        options: of the tracker, to begin with.
        opened: the room, where it is open already.
    """

    is_live = True

    def __init__(
        self, plan: LivePlan, *, options: TrackerOptions, opened: ScenePackage | None = None
    ) -> None:
        super().__init__(plan.scene)
        self.plan = plan
        self.live: LiveSession | None = None
        self.doors: Doors | None = None
        """How people join; None before the session is made."""
        self._joining = ""
        self.report: Path | None = None
        self.checks: Sequence[Check] = ()
        """The last findings."""
        self.found: Slot[Sequence[Check]] = Slot()
        """The same, until somebody has taken it."""
        self._options = options
        self._given = opened
        self._is_closing = False
        self._rehearsed: RehearsedLive | None = None
        self._wearing: Wearing | None = None
        self._checker: Task[None] | None = None
        self._over = threading.Event()

    @property
    def plays(self) -> bool:
        """See `SceneJob`."""
        return True

    @property
    def session(self) -> Session | None:
        """See `SceneJob`; None before the camera is placed."""
        return None if self.live is None else self.live.tracked

    @property
    def drawing(self) -> str:
        """How far the simulated camera is with its film; empty for a real camera."""
        if not self.plan.is_simulated:
            return ""
        drawing = "" if self._rehearsed is None else self._rehearsed.drawing
        return drawing or "it begins in a moment"

    @property
    def hub(self) -> Hub | None:
        """People who are connected; None while nobody can join."""
        return None if self.doors is None else self.doors.hub

    @property
    def is_checking(self) -> bool:
        """Whether everything is being looked at."""
        return self._checker is not None and self._checker.is_running

    def check(self) -> None:
        """Look at everything again, on a thread; once more when the first picture comes."""
        live = self.live
        if live is not None and not self.is_checking:
            self._checker = Task("live checks", lambda _: self._check(live)).start()

    def ask_to_stop(self) -> None:
        """End the session: it writes its report, and the thread ends soon after."""
        super().ask_to_stop()
        if self.live is not None:
            self.live.end()

    def cancel(self) -> None:
        """End it and wait, for a few seconds at most; nothing is measured any more."""
        self._is_closing = True
        self.ask_to_stop()
        if not self._task.join(CLOSE_S) and self._rehearsed is not None:
            self._rehearsed.__exit__(None, None, None)

    def adjust_tracker(self, options: TrackerOptions) -> bool:
        """See `SceneJob`; before pictures are tracked they are what it begins with."""
        live = self.live
        if live is None:
            return False
        if options != live.options:
            live.adjust_tracker(options)
        return True

    def make_live(self, surface: LiveSurface) -> None:
        """See `SceneJob`."""
        if self.live is None:
            raise ValueError("live surfaces: wait until the camera is placed")
        self.live.make_live(surface)

    def _run(self, _task: Task[None]) -> None:
        try:
            self._play()
        except Exception as error:  # noqa: BLE001 - shown in the window's log
            self.failure = self.failure or error
        finally:
            self._over.set()

    def _play(self) -> None:
        from scenes.opening import open_scene
        from studio.live.rehearsed import RehearsedLive, usual_feed

        plan = self.plan
        self.lines.put("opening the scene …")
        scene = self._given or open_scene(plan.scene)
        self.opened = scene
        plan.out.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            live = self._session(scene, stack)
            if plan.is_simulated:
                truth = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "truth.jsonl"
                self._rehearsed = stack.enter_context(
                    RehearsedLive(
                        live,
                        usual_feed(plan.scene, plan.scenario, plan.seed),
                        truth=truth,
                        seconds=plan.seconds,
                    )
                )
                if self._wearing is not None:
                    self._wearing.follow(truth)
                self._watch = self._rehearsed.watch
                self._rehearsed.direct()
            Task("live session", self._watch_over).start()
            self.check()
            self._finish(live.run(self._see))

    def headsets(self) -> tuple[PageHeadset, ...]:
        """Return headsets of people who have joined by the page."""
        return () if self.hub is None else self.hub.headsets()

    def _session(self, scene: ScenePackage, stack: ExitStack) -> LiveSession:
        """Make the session, and let people join it until the stack is left."""
        from devices.clock import WallClock
        from scenes.render.native import NativeRenderer
        from studio.live.live import LiveSession
        from studio.live.locating import RoomLocator
        from studio.live.people.doors import Doors
        from studio.live.people.hosting import invitations_for, join_line
        from studio.live.setup import recording_in

        plan, clock, renderer = self.plan, WallClock(), NativeRenderer()
        hosting = plan.hosting
        self.doors = doors = Doors(scene, clock=clock, say=self.lines.put)
        stack.callback(doors.end)
        if hosting is not None:
            hub = doors.open(hosting)
            self._joining = join_line(hub, hosting, invitations=invitations_for(hub, hosting))
        self._wearing = self._worn(scene, doors, clock=clock, stack=stack)
        live = LiveSession(
            plan.scene,
            scene,
            plan.setup,
            clock=clock,
            renderer=renderer,
            locate=RoomLocator(scene, renderer),
            record_to=recording_in(plan.out) if plan.records else None,
            asks=True,
            people=self._shared(scene, doors, clock=clock, stack=stack),
            worn=None if self._wearing is None else self._wearing.worn,
        )
        if self._options != live.options:
            live.adjust_tracker(self._options)
        if plan.seconds is not None:
            live.go_live()
        self.live = live
        if self._cancelled.is_set():
            live.end()
        return live

    def _worn(
        self, scene: ScenePackage, doors: Doors, *, clock: Clock, stack: ExitStack
    ) -> Wearing | None:
        """Return the local user's headset, until the stack is left."""
        from studio.live.hololens.wearing import worn_for

        plan = self.plan
        if not plan.wears:
            return None
        return worn_for(
            plan.setup.hololens,
            scene,
            scene_name=plan.scene,
            seed=plan.seed,
            clock=clock,
            hub=lambda: doors.hub,
            stack=stack,
            say=self.lines.put,
        )

    def _shared(
        self, scene: ScenePackage, doors: Doors, *, clock: Clock, stack: ExitStack
    ) -> People:
        """Return all people: those at the doors and, where the session is shared, at sites."""
        sharing = self.plan.sharing
        if sharing is None:
            return doors
        from studio.live.sites.sharing import shared

        return stack.enter_context(
            shared(
                sharing,
                scene,
                scene_name=self.plan.scene,
                inner=doors,
                hub=lambda: doors.hub,
                clock=clock,
                say=self.lines.put,
            )
        )

    def _finish(self, result: LiveResult) -> None:
        """The report, and the last words."""
        from studio.live.report import live_rows, write_report

        plan = self.plan
        if result.session is None:
            self.last_words = "ended before the camera was ready; nothing was recorded"
            return
        self.lines.put("writing the report …")
        rows = live_rows(result)
        if self._rehearsed is not None and not self._is_closing:
            rows += self._rehearsed.rows(result)
        if self._wearing is not None and not self._is_closing:
            rehearsed = self._rehearsed
            rows += self._wearing.rows(() if rehearsed is None else rehearsed.true_poses())
            self._wearing.save(plan.out)
        checks = self.checks
        self.report = write_report(plan.out, result, rows, scene=plan.scene, checks=checks)
        if result.recording is not None and result.recording.exists():
            self.recording = result.recording
        self.last_words = f"the live session has ended; the report is {self.report}"

    def _watch_over(self, _task: Task[None]) -> None:
        """Say how it goes; end it where the simulated camera has failed, or its time is over."""
        live, limit_s = self.live, self.plan.seconds
        assert live is not None
        said = ""
        if self._joining:
            self.lines.put(self._joining)
        while not self._over.wait(LOOK_S):
            status = live.status()
            line = status.text
            if line != said and not self._cancelled.is_set():
                said = line
                self.lines.put(line)
            failure = "" if self._rehearsed is None else self._rehearsed.failure
            if failure and not self._cancelled.is_set():
                self.failure = ValueError(f"simulated camera: {failure}")
                live.end()
                return
            live_s = status.live_s
            if limit_s is not None and live_s is not None and live_s >= limit_s:
                live.end()
                return

    def _check(self, live: LiveSession) -> None:
        from studio.live.checks import live_checks
        from studio.session.preflight import run_checks, save_checks

        had_none = True
        while had_none and not self._over.is_set():
            had_none = live.picture is None
            probes = live_checks(
                live,
                recordings=self.plan.out,
                simulated=(lambda: self.drawing) if self.plan.is_simulated else None,
                headsets=self.headsets(),
            )
            self.checks = checks = run_checks(probes)
            self.found.put(checks)
            try:
                save_checks(checks, self.plan.out / "preflight.json")
            except OSError as error:
                self.lines.put(f"the checks cannot be saved: {error}")
            while live.picture is None and not self._over.wait(LOOK_S):
                continue
