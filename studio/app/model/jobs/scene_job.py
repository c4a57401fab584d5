"""A thread that opens a scene, and plays a session in it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from devices.streams import Slot
from scenes.workers.task import Task
from studio.console.progress import Progress

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from scenes.package import ScenePackage
    from scenes.state import LiveSurface
    from sim.faults.fault import Fault
    from studio.rehearsal import Performance
    from studio.session.plan import SessionPlan
    from studio.session.session import Session, SessionOutput
    from studio.session.trackers.methods import MethodMaker
    from tracking.options import TrackerOptions

Watch = Callable[["SessionOutput"], None]


class SceneJob:
    """Opens a scene, and plays a session in it if a plan is given, on a thread of its own.

    The window polls; nothing here touches a widget.

    Args:
        scene: name or path.
        plan: what to play, or None to look at the scene only.
        out: folder for the results; None plays without leaving any.
        watch: sees every result on the job's thread.
        keeps: whether what was played until it is stopped is kept, marked as cut short.
        trains_again: whether the scene's photos are trained once more first, see
            `studio.session.staging.add_reality`.
    """

    is_live = False
    """Whether its pictures are a live camera's."""

    def __init__(
        self,
        scene: str,
        plan: SessionPlan | None = None,
        out: Path | None = None,
        watch: Watch | None = None,
        *,
        keeps: bool = False,
        trains_again: bool = False,
    ) -> None:
        self.outputs: Slot[SessionOutput] = Slot()
        self.lines: Slot[str] = Slot()
        self.opened: ScenePackage | None = None
        self._played: Session | None = None
        self.performance: Performance | None = None
        self.failure: BaseException | None = None
        self.last_words = ""
        """Words at its end; empty for the usual ones."""
        self.recording: Path | None = None
        """Its recording, where that is not beside the performance's figures."""
        self._plan, self._out, self._watch = plan, out, watch
        self.scene = scene
        self._keeps, self._trains_again = keeps, trains_again
        self._cancelled, self._stopped = threading.Event(), threading.Event()
        self._task = Task("session", self._run)

    def offer(self, trackers: Mapping[str, MethodMaker], faults: tuple[type[Fault], ...]) -> None:
        """The plan may ask for these trackers and faults, too; before it has begun."""
        if self._plan is not None:
            more = {**self._plan.more_methods, **trackers}
            self._plan = replace(self._plan, more_methods=more, more_faults=faults)

    def start(self) -> None:
        """Begin."""
        self._task.start()

    @property
    def session(self) -> Session | None:
        """The session that plays; None before it does."""
        return self._played

    @property
    def running(self) -> bool:
        """Whether it is still at work."""
        return self._task.is_running

    @property
    def stops(self) -> bool:
        """Whether it was asked to stop."""
        return self._cancelled.is_set() or self._stopped.is_set()

    @property
    def plays(self) -> bool:
        """Whether it plays a session, or only opens a scene."""
        return self._plan is not None

    def ask_to_stop(self) -> None:
        """Ask it to stop, without waiting for it; what was played is kept if it is to be."""
        (self._stopped if self._keeps else self._cancelled).set()

    def cancel(self) -> None:
        """Ask it to stop and wait until it has."""
        self.ask_to_stop()
        self._task.join()

    def adjust_tracker(self, options: TrackerOptions) -> bool:
        """Track with other settings from the next picture on; False while there is no session.

        Raises:
            StreamFullError: more was asked for than the session could take.
        """
        if self.session is None:
            return False
        self.session.adjust_tracker(options)
        return True

    def make_live(self, surface: LiveSurface) -> None:
        """Show live video on a surface.

        Raises:
            StreamFullError: more was asked for than the session could take.
            ValueError: there is no session.
        """
        if self.session is None:
            raise ValueError("a live surface needs a session: rehearse first")
        self.session.make_live(surface)

    def _run(self, _task: Task[None]) -> None:
        progress = Progress(lambda text, _final: self.lines.put(text))
        try:
            if self._plan is None:
                from scenes.opening import open_scene

                progress.begin("opening the scene")
                self.opened = open_scene(self.scene)
                progress.finish()
            elif self._out is not None:
                from studio.rehearsal import perform

                if self._trains_again:
                    self._train_again(progress)
                self.performance = perform(
                    self._plan,
                    self._out,
                    progress=progress,
                    opened=self._see_session,
                    watch=self._see,
                    cancelled=self._cancelled,
                    stopped=self._stopped,
                )
            else:
                from studio.session.opening import open_session

                progress.begin("replaying")
                session = open_session(self._plan)
                self._see_session(session)
                session.run(self._see, cancelled=self._cancelled)
                progress.finish()
        except Exception as error:  # noqa: BLE001 - raised again where the window is closed
            self.failure = error

    def _train_again(self, progress: Progress) -> None:
        from scenes.prepare.progress import Cancelled
        from studio.console.progress import StageProgress
        from studio.session.pipeline import CancelledError
        from studio.session.staging import add_reality

        stages = StageProgress(progress)

        def show(done: float, note: str) -> None:
            if self.stops:
                raise Cancelled
            stages(done, note)

        try:
            add_reality(Path(self.scene), progress=show)
        except Cancelled:
            raise CancelledError from None

    def _see_session(self, session: Session) -> None:
        self._played = session
        self.opened = session.scene

    def _see(self, output: SessionOutput) -> None:
        self.outputs.put(output)
        if self._watch is not None:
            self._watch(output)
