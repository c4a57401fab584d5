"""Forks of the open recording and comparisons of two runs: begun here, finished by polling."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devices.recording import read_session
from scenes.workers.task import Task
from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.workbench import Workbench
from studio.app.timeline.comparison.forking import (
    PlannedFork,
    TwoRuns,
    comparing,
    planning_fork,
    writing_page,
)

if TYPE_CHECKING:
    from studio.session.plan import SessionPlan

PLANNING = "a fork"
"""Names the planning of a fork in `Workbench.busy`: scripts wait for it."""


@dataclass(frozen=True, slots=True)
class _Asked:
    """A fork that was asked for.

    Attributes:
        recording: that it is of.
        words: of its folder's name.
        out: folder that was asked for, or None.
        anyway: whether it is played even if nothing would be different.
    """

    recording: Path
    words: tuple[str, str]
    out: Path | None
    anyway: bool


class Runs:
    """Forks and comparisons of runs.

    Args:
        bench: whose session plays forks, and where it is said how it went.
    """

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench
        self.compared: TwoRuns | None = None
        """The last comparison."""
        self.page: Path | None = None
        """The page that was written last."""
        self._planning: Task[PlannedFork] | None = None
        self._asked: _Asked | None = None
        self._comparing: Task[TwoRuns] | None = None
        self._compared_folders: tuple[Path, Path] | None = None
        """Folders of the comparison that is running."""
        self._next_folders: tuple[Path, Path] | None = None
        """Folders to compare after those."""
        self._writing: Task[Path] | None = None
        self._pair: tuple[Path, Path] | None = None
        """Folders of the original and of its fork."""

    def fork(self, at_s: float, out: str, *, anyway: bool = False) -> None:
        """Play on from an instant of the open recording; the result is B.

        Args:
            at_s: the instant, seconds of the session.
            out: folder for the results, or one named after it if it is there; "" for a new one.
            anyway: also if nothing would be different; otherwise that is said, and asked.

        Raises:
            ValueError: nothing is open, or something is playing.
            OSError: the recording cannot be read.
        """
        session, recording = self.bench.session, self.bench.recording
        if session is None or recording is None or self._planning is not None:
            raise ValueError("a fork needs an open recording, and no other fork being planned")
        if session.is_playing:
            raise ValueError("a session is playing already: stop it first")
        words = (read_session(recording).scenario_name, f"fork at {at_s:.1f} s")
        self._asked = _Asked(recording, words, Path(out) if out else None, anyway)
        self.bench.busy.add(PLANNING)
        self._planning = planning_fork(
            recording,
            at_s=at_s,
            document=self.bench.document,
            scene=self.bench.scene,
            more_faults=tuple(self.bench.offered.faults.values()),
        )

    @property
    def has_pair(self) -> bool:
        """Whether there is a fork to compare with what it comes from."""
        return self._pair is not None

    def is_fork(self, recording: Path) -> bool:
        """Whether a recording is what the last fork has left."""
        return self._pair is not None and recording.parent == self._pair[1]

    def compare(self, a: str = "", b: str = "") -> None:
        """Compare two folders; without any, the last fork with what it comes from.

        While a comparison is running, another pair waits for its end, the last that was asked for.

        Raises:
            ValueError: there was no fork.
        """
        if not (a and b) and self._pair is None:
            raise ValueError("compare: fork a recording first, or name the folders a and b")
        pair = (Path(a), Path(b)) if a and b else self._pair
        assert pair is not None
        if self._comparing is None:
            self._compared_folders, self._comparing = pair, comparing(*pair)
        elif pair == self._compared_folders:
            self._next_folders = None
            self.bench.say("info", "compare: these two runs are being compared already")
        else:
            self._next_folders = pair
            self.bench.say("info", "compare: begins when the comparison before it has ended")

    def write_page(self) -> None:
        """Begin to write the comparison as a page."""
        if self.compared is not None and self._writing is None:
            self._writing = writing_page(self.compared.comparison)

    def poll(self) -> TwoRuns | None:
        """Take what the threads have left; a comparison that is just there."""
        self._poll_fork()
        self._poll_page()
        task = self._comparing
        if task is None or task.is_running:
            return None
        self._comparing = None
        if task.result is None:
            self.bench.say("error", task.problem or "the runs cannot be compared")
        else:
            self.compared = task.result
        if self._next_folders is not None:
            pair, self._next_folders = self._next_folders, None
            self._compared_folders, self._comparing = pair, comparing(*pair)
        return task.result

    def _poll_fork(self) -> None:
        task, asked = self._planning, self._asked
        if task is None or task.is_running or asked is None:
            return
        self._planning = None
        self.bench.busy.discard(PLANNING)
        planned = task.result
        if planned is None:
            self.bench.say("error", task.problem or "the fork cannot be planned")
        elif planned.in_vain and not asked.anyway:
            self.bench.say("warning", planned.in_vain)
            ways = {"Fork all the same": lambda: self._play(asked, planned.plan)}
            self.bench.notify(planned.in_vain, "warning", ways)
        else:
            self._play(asked, planned.plan)

    def _play(self, asked: _Asked, plan: SessionPlan) -> None:
        session = self.bench.session
        assert session is not None
        if session.is_playing:  # the question was answered late
            self.bench.say("error", "fork: a session is playing already: stop it first")
            return
        try:
            out = session.new_folder(*asked.words, out=asked.out)
        except OSError as error:
            self.bench.say("error", f"fork: {error}")
            return
        self._pair = asked.recording.parent, out
        self.bench.say("info", f"forking into {out}: the start is played again first")
        session.play(SceneJob(plan.scene, plan, out, keeps=True))

    def _poll_page(self) -> None:
        task = self._writing
        if task is None or task.is_running:
            return
        self._writing, self.page = None, task.result
        if task.result is None:
            self.bench.say("error", task.problem or "the page cannot be written")
        else:
            self.bench.say("info", f"page: {task.result}")

    def take_page(self) -> Path | None:
        """The page that has been written since the last time."""
        page, self.page = self.page, None
        return page

    def close(self) -> None:
        """Cancel what is going on and wait for it."""
        tasks: list[Task[Any] | None] = [self._planning, self._comparing, self._writing]
        for task in tasks:
            if task is not None:
                task.cancel()
                task.join()
