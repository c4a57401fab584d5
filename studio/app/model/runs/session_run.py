"""Opens scenes and plays sessions for the workbench: what runs now, and what it has led to."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from studio.app.model.documents.document import Document
from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.jobs.share_job import ShareJob
from studio.app.model.workbench import Topic, Workbench
from studio.console.rows import exit_code
from studio.session.records.outputs import RECORDING
from tracking.options import TrackerOptions, options_text

PROBLEMS = 100
"""Lines of trackers that failed, until the window takes them; of more, the oldest go."""

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from studio.session.session import SessionOutput
    from studio.session.trackers.methods import MethodMaker


class SessionRun:
    """What is opened or played. One at a time; `poll` is called by the window's timer.

    Args:
        bench: what it reports to.
        out: folder for rehearsals that are started here.
        scenarios: folder where a document's scenario is written for the session to read.
    """

    def __init__(self, bench: Workbench, *, out: Path, scenarios: Path) -> None:
        self.out = out
        self.output: SessionOutput | None = None
        self.line = ""
        """How far the work is, in words."""
        self.trying: TrackerOptions | None = None
        """The tracker's settings that are tried beside the session."""
        self._bench = bench
        self._scenarios = scenarios
        self._job: SceneJob | None = None
        self._next: SceneJob | None = None
        self._share: ShareJob | None = None
        self._is_playing = self._is_open = self._next_plays = False
        self._problems: deque[str] = deque(maxlen=PROBLEMS)
        self._options = bench.document.tracker.options
        """The tracker's settings that the session follows."""

    @property
    def job(self) -> SceneJob | None:
        """What runs or ran last."""
        return self._job

    @property
    def is_busy(self) -> bool:
        """Whether a scene is being opened or a session is playing."""
        return self._job is not None and self._job.running

    @property
    def is_playing(self) -> bool:
        """Whether a session is playing."""
        return self.is_busy and self._is_playing

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
        return self._share is not None

    def share(self, rehearsal: Path, out: Path) -> None:
        """Make film, viewer, sheet and archive of a rehearsal's folder, on a thread.

        Raises:
            ValueError: one is being made.
        """
        if self._share is not None:
            raise ValueError("a hand-over is being made already")
        self._share = ShareJob(rehearsal, out)
        self._bench.announce(Topic.SESSION)

    def open_scene(self, scene: str) -> None:
        """Open a scene; what runs is cancelled."""
        self._bench.show_scene(None)
        self._begin(SceneJob(scene), plays=False)

    def rehearse(self, *, out: Path | None = None, is_paced: bool = False) -> None:
        """Play the document's scenario in its scene.

        Args:
            out: folder for the results; None for the usual one.
            is_paced: in real time, dropping frames, instead of every frame in its own time.

        Raises:
            ValueError: a session is playing, or the chosen tracker is not there.
            OSError: the scenario cannot be written down.
        """
        from studio.session.plan import Pace, SessionPlan

        if self.is_playing:
            raise ValueError("a session is playing already: stop it first")
        plan = SessionPlan(
            scene=self._bench.document.scene,
            scenario=self._scenario_file(self._bench.document),
            seed=self._bench.document.seed,
            methods=self._methods(),
            pace=Pace.PACED if is_paced else Pace.EXACT,
            options=self._bench.document.tracker.options,
        )
        self.play(SceneJob(plan.scene, plan, out or self.out))

    def track_again(self, recording: Path, out: Path | None = None) -> None:
        """Track the pictures of a recording with the chosen tracker.

        Args:
            recording: whose pictures.
            out: folder for the results; None for one beside the recording's.

        Raises:
            ValueError: a session is playing, or the chosen tracker is not there.
            OSError: the recording cannot be read.
        """
        from devices.recording import read_session
        from studio.session.plan import SessionPlan

        if self.is_playing:
            raise ValueError("a session is playing already: stop it first")
        methods = self._methods()
        folder = recording.resolve().parent
        plan = SessionPlan(
            scene=read_session(recording).scene,
            recording=recording,
            methods=methods,
            options=self._bench.document.tracker.options,
        )
        name = f"{folder.name}-{methods[0]}"
        self.play(SceneJob(plan.scene, plan, out or folder.with_name(name)))

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

    def check_tracker(self, name: str) -> None:
        """Refuse a tracker that is not there.

        Raises:
            ValueError: it is not.
        """
        from studio.session.trackers.methods import METHODS

        known = (*METHODS, *self._bench.offered.trackers)
        if name not in known:
            raise ValueError(
                f"tracker {name!r}: wanted one of {', '.join(known)}; one of a plug-in is there "
                "while its file is in the folder of plug-ins and loads"
            )

    def _methods(self) -> tuple[str, ...]:
        """Names of the trackers that the document asks for; the first is shown."""
        from studio.session.trackers.methods import METHODS

        choice = self._bench.document.tracker
        self.check_tracker(choice.name)
        is_beside = choice.is_beside and choice.name != METHODS[0]
        return (choice.name, METHODS[0]) if is_beside else (choice.name,)

    def _guarded(self) -> dict[str, MethodMaker]:
        """The trackers of plug-ins; what goes wrong in one is in the log."""
        from studio.session.trackers.guarded import GuardedMethod

        say = self._problems.append
        offered = self._bench.offered.trackers
        return {name: partial(GuardedMethod, name, make, say=say) for name, make in offered.items()}

    def play(self, job: SceneJob) -> None:
        """Play a session that somebody has planned."""
        self._options = self._bench.document.tracker.options
        job.offer(self._guarded(), tuple(self._bench.offered.faults.values()))
        self._bench.open_recording(None)
        self._begin(job, plays=True)

    def stop(self) -> None:
        """Ask what runs to stop."""
        if self._job is not None and self._job.running:
            self.line = "stopping …"
            self._job.ask_to_stop()
            self._bench.announce(Topic.SESSION)

    def close(self) -> None:
        """Cancel and wait: the window closes."""
        if self._job is not None:
            self._job.cancel()
        if self._share is not None:
            self._share.close()

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
        self._poll_share()
        while self._problems:
            self._bench.say("error", self._problems.popleft())
        job = self._job
        if job is None:
            return
        if job.opened is not None and self._bench.scene is not job.opened:
            self._bench.show_scene(job.opened)
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

    def _adjust(self, job: SceneJob) -> None:
        """Let the session that plays follow the document's settings, after a change or undo."""
        wanted = self._bench.document.tracker.options
        if self.is_playing and wanted != self._options and job.adjust_tracker(wanted):
            self._options = wanted
            self._bench.say("info", f"the tracker goes on with {options_text(wanted)}")

    def _poll_share(self) -> None:
        job = self._share
        if job is None:
            return
        line = job.lines.take()
        if line is not None:
            self.line = line
            self._bench.announce(Topic.SESSION)
        if job.is_running:
            return
        self._share = None
        if job.shared is not None:
            self._bench.say("info", f"shared: open {job.shared.viewer} in any browser")
        else:
            self._bench.say("error", str(job.failure))
        self._bench.announce(Topic.SESSION)

    def _begin(self, job: SceneJob, *, plays: bool) -> None:
        if self.is_busy:
            # The thread ends by itself soon; the new one begins then.
            assert self._job is not None
            self._job.ask_to_stop()
            self._next = job
            self._next_plays = plays
            self.line = "stopping …"
            return
        self._job, self._is_playing, self._is_open = job, plays, True
        self.output = self.trying = None
        self.line = "opening the scene …"
        job.start()
        self._bench.announce(Topic.SESSION)

    def _end(self, job: SceneJob) -> None:
        self._is_open, self.trying = False, None
        was_playing, self._is_playing = self._is_playing, False
        self.line = self._last_words(job, was_playing)
        self._bench.announce(Topic.SESSION)
        if self._next is not None:
            following, self._next = self._next, None
            self._begin(following, plays=self._next_plays)
        elif job.performance is not None:
            self._bench.open_recording(job.performance.folder / RECORDING)
        elif job.recording is not None:
            self._bench.open_recording(job.recording)

    def _last_words(self, job: SceneJob, was_playing: bool) -> str:
        from studio.session.pipeline import CancelledError

        if isinstance(job.failure, CancelledError):
            self._bench.say("info", "cancelled; nothing was kept")
            return "cancelled; nothing was kept"
        if job.failure is not None:
            words = " ".join(str(job.failure).split()) or type(job.failure).__name__
            self._bench.say("error", words)
            return f"✖ {words}"
        if job.performance is not None:
            missed = exit_code(job.performance.rows)
            verdict = "✗ a figure misses its bar" if missed else "✓ every figure meets its bar"
            text = f"{verdict}; the report is in {job.performance.folder}"
            self._bench.say("warning" if missed else "info", text)
            return text
        if job.last_words:
            self._bench.say("info", job.last_words)
            return job.last_words
        return "the replay has ended" if was_playing else "ready"

    def _scenario_file(self, document: Document) -> str | None:
        if not document.scenario:
            return document.scenario_name or None
        self._scenarios.mkdir(parents=True, exist_ok=True)
        path = self._scenarios / f"{document.scenario_name or 'scenario'}.toml"
        path.write_text(document.scenario, encoding="utf-8")
        return str(path)


def with_scene(document: Document, scene: str) -> Document:
    """A new document for a scene; nothing of the old one's rooms fits another."""
    return replace(Document(scene), seed=document.seed, tracker=document.tracker)
