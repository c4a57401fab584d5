"""Opens scenes and plays sessions for the workbench: what runs now, and what it has led to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from studio.app.model.documents.arranged import arranged_text
from studio.app.model.documents.document import Document, TrackerChoice
from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.runs.ending import Ending, ending_of, remedies_of
from studio.app.model.runs.handing_over import HandingOver
from studio.app.model.runs.session_folders import SessionFolders, let_go, reserved
from studio.app.model.runs.trackers import Trackers
from studio.app.model.workbench import Topic, Workbench
from studio.session.records.outputs import RECORDING
from tracking.options import TrackerOptions, options_text

Shown = Callable[["ScenePackage"], None]
"""Shows a scene that was read."""

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from scenes.package import ScenePackage
    from studio.session.session import SessionOutput


class SessionRun:
    """Opens scenes and plays sessions, one at a time; `poll` is called by the window's timer.

    Args:
        bench: what it reports to.
        out: folder where every session gets one of its own.
        scenarios: folder where a document's scenario is written for the session to read.
        make_job: makes what reads a scene or plays a session.
    """

    def __init__(
        self,
        bench: Workbench,
        *,
        out: Path,
        scenarios: Path,
        make_job: Callable[..., SceneJob] = SceneJob,
    ) -> None:
        self.folders = SessionFolders(out)
        self.output: SessionOutput | None = None
        self.line = ""
        """How far the work is, in words."""
        self.trying: TrackerOptions | None = None
        """The tracker's settings that are tried beside the session."""
        self._bench = bench
        self._make_job = make_job
        self._scenarios = scenarios
        self._job: SceneJob | None = None
        self._then: Shown | None = None
        self._next: tuple[SceneJob, Shown | None] | None = None
        self._reserved: Path | None = None
        self.handing = HandingOver(bench)
        self._is_open = False
        self.trackers = Trackers(bench)
        self._options = bench.document.tracker.options
        """The tracker's settings that the session follows."""

    @property
    def job(self) -> SceneJob | None:
        """The job that runs or ran last."""
        return self._job

    @property
    def is_busy(self) -> bool:
        """Whether a scene is being opened or a session is playing."""
        return self._job is not None and self._job.running

    @property
    def is_playing(self) -> bool:
        """Whether a session is playing, or is being wound up."""
        return self._bench.standing.is_session

    @property
    def is_opening(self) -> bool:
        """Whether a scene is being opened."""
        return self.is_busy and not self.is_playing

    @property
    def out(self) -> Path:
        """Folder where every session gets one of its own."""
        return self.folders.root_of(self._bench.project)

    @out.setter
    def out(self, root: Path) -> None:
        self.folders.root = root

    @property
    def report(self) -> Path | None:
        """Folder of the last rehearsal that ended here, or None."""
        performance = None if self._job is None else self._job.performance
        return None if performance is None else performance.folder

    @property
    def shown_rehearsal(self) -> Path | None:
        """Folder of the recording that is open, if a rehearsal left it there."""
        recording = self._bench.recording
        return recording.parent if recording is not None and recording.name == RECORDING else None

    @property
    def is_sharing(self) -> bool:
        """Whether a hand-over is being made."""
        return self.handing.is_running

    def open_scene(self, scene: str, then: Shown | None = None) -> None:
        """Read a scene; what plays is stopped first, and what it has recorded is kept.

        Args:
            scene: name or path.
            then: shows it once it is read; None shows it on the bench. Nothing is shown of one that
                cannot be read, nor of one after which another one was asked for.
        """
        self._begin(self._make_job(scene), then)

    def rehearse(
        self, *, out: Path | None = None, is_paced: bool = False, trains_again: bool = False
    ) -> None:
        """Play the document's scenario in its scene.

        Args:
            out: folder for the results, or one named after it if it is there; None for a new one.
            is_paced: in real time, dropping frames, instead of every frame in its own time.
            trains_again: train the scan's photos first, as objects cut out of it need.

        Raises:
            ValueError: a session is playing, or the chosen tracker is not there.
            OSError: the scenario or the folder cannot be written.
        """
        from studio.session.plan import Pace, SessionPlan

        self._check_free()
        document = self._bench.document
        plan = SessionPlan(
            scene=document.scene,
            scenario=self._scenario_file(document),
            seed=document.seed,
            methods=self.trackers.names(),
            pace=Pace.PACED if is_paced else Pace.EXACT,
            options=document.tracker.options,
            arranged=arranged_text(document.twin),
        )
        folder = self.new_folder(document.scenario_name or "rehearsal", out=out)
        self.play(self._make_job(plan.scene, plan, folder, keeps=True, trains_again=trains_again))

    def track_again(self, recording: Path, out: Path | None = None) -> None:
        """Track the pictures of a recording with the chosen tracker.

        Args:
            recording: whose pictures.
            out: folder for the results, or one named after it if it is there; None for a new one.

        Raises:
            ValueError: a session is playing, or the chosen tracker is not there.
            OSError: the recording cannot be read, or the folder cannot be made.
        """
        from devices.recording import read_session
        from studio.session.plan import SessionPlan

        self._check_free()
        methods = self.trackers.names()
        info = read_session(recording)
        plan = SessionPlan(
            scene=info.scene,
            recording=recording,
            methods=methods,
            options=self._bench.document.tracker.options,
        )
        folder = self.new_folder(info.scenario_name, f"tracked again by {methods[0]}", out=out)
        self.play(self._make_job(plan.scene, plan, folder, keeps=True))

    def new_folder(self, *words: str, out: Path | None = None) -> Path:
        """Make the folder of the session that comes next; it goes if that leaves nothing.

        Args:
            words: what it is of, beside the room.
            out: the folder that was asked for, or one named after it if it is there.

        Raises:
            OSError: it cannot be made.
        """
        self._let_go()
        if out is not None:
            folder = reserved(out)
        else:
            room = Path(self._bench.document.scene).stem
            folder = self.folders.reserve(self._bench.project, (room, *words))
        self._reserved = folder
        return folder

    def _check_free(self) -> None:
        if self.is_playing:
            raise ValueError("a session is playing already: stop it first")
        if self.is_opening:
            raise ValueError("a room is being opened: wait until it is shown")

    def try_tracker(self, options: TrackerOptions | None) -> None:
        """Track with other settings beside the session; None ends it.

        Raises:
            ValueError: no session plays.
        """
        session = None if self._job is None else self._job.session
        if session is None or not self.is_playing:
            raise ValueError("there is nothing to try settings on: rehearse first")
        session.try_tracker(options)
        self.trying = options
        self._bench.announce(Topic.SESSION)

    def play(self, job: SceneJob) -> None:
        """Play a session that somebody has planned.

        Raises:
            StandingError: one is playing.
        """
        self._options = self._bench.document.tracker.options
        job.offer(self.trackers.guarded(), tuple(self._bench.offered.faults.values()))
        self._begin(job, None)

    def stop(self) -> None:
        """Ask what runs to stop; of a session, what was recorded until then is kept."""
        if self._job is not None and self._job.running:
            self.line = "stopping …"
            self._job.ask_to_stop()
            self._bench.announce(Topic.SESSION)

    def close(self) -> None:
        """Stop and wait: the window closes."""
        if self._job is not None:
            self._job.cancel()
        self._let_go()
        self.folders.close()
        self.handing.close()

    def make_live(self, name: str, clicks_px: object) -> None:
        """Make what was clicked in the front lens's picture a live surface of the session.

        Args:
            name: of the surface.
            clicks_px: (4, 2) picture pixels, top left first.

        Raises:
            ValueError: there is no session, or no flat surface where it was clicked.
        """
        import numpy as np

        from studio.session.live_surfaces import clicked_surface

        session = None if self._job is None else self._job.session
        if session is None or self.output is None:
            raise ValueError("a live surface needs a session: rehearse first")
        frame, room = self.output.input.frame, session.scene.room
        pose = self.output.shown.world_from_rig
        surface = clicked_surface(name, np.asarray(clicks_px, dtype=float), frame, pose, room)
        assert self._job is not None
        self._job.make_live(surface)

    def poll(self) -> None:
        """Take what the threads have left since the last time."""
        shared = self.handing.poll()
        if shared is not None:
            self.line = shared
            self._bench.announce(Topic.SESSION)
        self.trackers.say_problems()
        job = self._job
        if job is None:
            return
        self._show_played(job)
        line = job.lines.take()
        output = job.outputs.take()
        if output is not None:
            self.output = output
            picture = output.input.frame.images[0]
            self._bench.show_state(output.state, live=output.surfaces, camera_picture=picture)
        if line is not None:
            self.line = line
        if line is not None or output is not None:
            self._bench.announce(Topic.SESSION)
        if not job.running and self._is_open:
            self._end(job)
        else:
            self._adjust(job)

    def _show_played(self, job: SceneJob) -> None:
        """Show the room that a session plays in, unless it is the one that is open.

        The session's own has camera and objects where its scenario puts them; what is open has
        them where they were scanned.
        """
        bench, played = self._bench, job.opened
        if not job.plays or played is None or bench.scene is played:
            return
        if bench.scene is None or job.scene != bench.document.scene:
            bench.show_scene(played)

    def _adjust(self, job: SceneJob) -> None:
        """Let the session that plays follow the document's settings, after a change or undo."""
        wanted = self._bench.document.tracker.options
        if self.is_playing and wanted != self._options and job.adjust_tracker(wanted):
            self._options = wanted
            self._bench.say("info", f"the tracker goes on with {options_text(wanted)}")

    def _begin(self, job: SceneJob, then: Shown | None) -> None:
        if self.is_busy:
            # The thread ends by itself soon; the new one begins then.
            assert self._job is not None
            self._job.ask_to_stop()
            self._next = job, then
            self.line = "stopping …"
            return
        if job.plays:
            self._bench.begin_session(is_live=job.is_live)
        self._job, self._then, self._is_open = job, then, True
        self.output = self.trying = None
        self.line = "opening the scene …"
        job.start()
        self._bench.announce(Topic.SESSION)

    def _end(self, job: SceneJob) -> None:
        """However it ended: the room is the user's again, or shows what was recorded."""
        self._is_open, self.trying = False, None
        then, self._then = self._then, None
        following, self._next = self._next, None
        ending = ending_of(job)
        self._let_go()
        if self.is_playing:
            self._bench.end_session(ending.shown if following is None else None)
        self._say(job, ending, is_followed=following is not None)
        self._bench.announce(Topic.SESSION)
        if following is not None:
            self._begin(*following)
        elif job.opened is not None and not job.plays and not (then and job.stops):
            (then or self._bench.show_scene)(job.opened)

    def _say(self, job: SceneJob, ending: Ending, *, is_followed: bool) -> None:
        bench, kept = self._bench, ending.kept
        self.line = f"✖ {ending.line}" if ending.is_failure else ending.line
        if ending.level is not None:
            bench.say(ending.level, ending.line)
        if ending.is_failure and not is_followed:
            bench.notify(ending.line, "error", remedies_of(job, bench.do))
        if kept is not None and not is_followed:
            bench.notify(
                ending.line,
                "info",
                {"Look at it": lambda: bench.do("timeline.open", path=str(kept))},
            )

    def _let_go(self) -> None:
        """A session that has left nothing leaves no folder, either."""
        if self._reserved is not None and not self.is_busy:
            let_go(self._reserved)
            self._reserved = None

    def _scenario_file(self, document: Document) -> str | None:
        if not document.scenario:
            return document.scenario_name or None
        self._scenarios.mkdir(parents=True, exist_ok=True)
        path = self._scenarios / f"{document.scenario_name or 'scenario'}.toml"
        path.write_text(document.scenario, encoding="utf-8")
        return str(path)


def with_scene(document: Document, scene: str) -> Document:
    """A new document for a scene: what was done to one room, or set for it, fits no other."""
    before = document.tracker
    tracker = TrackerChoice(before.name, before.is_beside)
    return replace(Document(scene), seed=document.seed, tracker=tracker)
