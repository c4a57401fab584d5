"""A random walk through the studio's modes over the real model: nothing may be lost on the way.

Rooms and sessions are staged: they are read and played in no time, and end as the walk decides. All
else is what the window has: documents, undo, questions, folders on the disk, modes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any, cast

from scenes.package import ScenePackage
from scenes.state import SceneState
from studio.app.model.documents.document import Change, Document, Marker
from studio.app.model.documents.document_file import load_document, save_document
from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.runs.leaving import Answer, Leaving, Replacing
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.settings import Settings
from studio.app.model.standing import EDGES, Happening, Mode
from studio.app.model.workbench import Topic, Workbench
from studio.console.rows import Row, at_least, at_most
from studio.rehearsal import Performance
from studio.session.pipeline import CancelledError
from studio.session.records.outputs import RECORDING, REPORT_JSON, output_folder

STEPS = 10_000
"""Of the walk that is measured."""

MAX_SESSIONS = 12
"""Folders that are kept at a time: older ones are deleted on the way."""

BAD = "bad"
"""Name of a room that cannot be read."""


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """All that the model wants of a room."""

    name: str
    objects: tuple[Any, ...] = ()


class StagedJob(SceneJob):
    """Reads or plays nothing; `finish` ends it as a real one would."""

    made: list[StagedJob]

    def start(self) -> None:
        """See `SceneJob`."""
        self.is_running = True

    is_running = False

    @property
    def running(self) -> bool:
        """See `SceneJob`."""
        return self.is_running

    def cancel(self) -> None:
        """See `SceneJob`."""
        self.ask_to_stop()
        if self.is_running:
            self.finish(fails=False)

    def finish(self, *, fails: bool) -> None:
        """End it: with what it has read or played, or with a failure."""
        self.is_running = False
        if fails or Path(self.scene).name == BAD:
            self.failure = ValueError(f"{self.scene}: cannot be read")
        elif not self.plays:
            self.opened = cast(ScenePackage, Room(self.scene))
        elif self._cancelled.is_set():
            self.failure = CancelledError()
        elif self._out is not None:
            cut_short = "stopped by the user" if self._stopped.is_set() else ""
            with output_folder(self._out) as part:
                (part / RECORDING).write_text(f"{self._out.name}{id(self)}", encoding="utf-8")
                (part / REPORT_JSON).write_text('{"rows": []}', encoding="utf-8")
            self.performance = Performance([], self._out, cut_short)


class StagedLive(StagedJob):
    """A live session."""

    is_live = True


class PlainHistory:
    """Undo without a window."""

    def __init__(self, show: Callable[[Document], None]) -> None:
        self._show = show
        self._changes: list[Change] = []
        self._done = 0

    @property
    def undoes(self) -> str:
        """See `History`."""
        return self._changes[self._done - 1].label if self._done else ""

    @property
    def redoes(self) -> str:
        """See `History`."""
        return self._changes[self._done].label if self._done < len(self._changes) else ""

    def push(self, change: Change) -> None:
        """See `History`."""
        del self._changes[self._done :]
        self._changes = [*self._changes[-100:], change]
        self._done = len(self._changes)

    def undo(self) -> None:
        """See `History`."""
        if self._done:
            self._done -= 1
            self._show(self._changes[self._done].before)

    def redo(self) -> None:
        """See `History`."""
        if self._done < len(self._changes):
            self._done += 1
            self._show(self._changes[self._done - 1].after)

    def clear(self) -> None:
        """See `History`."""
        self._changes, self._done = [], 0


class WalkedBench(Workbench):
    """A bench that knows which ways between the modes were walked."""

    edges: set[tuple[Mode, Happening]]

    def _happen(self, happening: Happening, recording: Path | None = None) -> None:
        before = self.standing.mode
        super()._happen(happening, recording)
        self.edges.add((before, happening))


class Walk:
    """The studio without its window, and what a user could do with it at random.

    Args:
        folder: an empty one, for projects and sessions.
    """

    def __init__(self, folder: Path) -> None:
        self.lost: list[str] = []
        """All that was lost, in words."""
        made: list[WalkedBench] = []
        history = PlainHistory(lambda document: made[0].show_document(document))
        self.bench = bench = WalkedBench(Document("first"), Settings(), history)
        made.append(bench)
        bench.edges = set()
        self.run = SessionRun(
            bench, out=folder / "sessions", scenarios=folder / "scenarios", make_job=StagedJob
        )
        bench.session = self.run
        self._folder = folder
        self._question: Callable[[Answer], None] | None = None
        self._leaving = Leaving(bench, self._ask, self.save)
        self._replacing = Replacing(bench, self.run, self._leaving)
        self._safe = [bench.document]
        self._before = bench.document
        self._number = 0
        self._seen: dict[Path, tuple[int, int, int]] = {}
        bench.listen(Topic.OPENED, self._on_opened)
        bench.listen(Topic.DOCUMENT, self._on_document)
        self.run.open_scene("first")
        self.end_job()

    # --- what a user does ------------------------------------------------------------------------

    def edit(self) -> None:
        """Change the document."""
        self._number += 1
        document = replace(self.bench.document, markers=(Marker(self._number, "edit"),))
        self.bench.change("Mark", document)

    def undo(self) -> None:
        """Take it back."""
        self.bench.history.undo()

    def redo(self) -> None:
        """Make it again."""
        self.bench.history.redo()

    def save(self) -> None:
        """Save the document, to a new file where it has none."""
        self._number += 1
        path = self.bench.project or self._folder / f"project-{self._number}.nexus"
        save_document(self.bench.document, path)
        self.bench.saved(path)
        self._safe.append(self.bench.document)

    def open_project(self) -> None:
        """Open the project that was saved last, if there is one."""
        found = sorted(self._folder.glob("*.nexus"), key=lambda path: path.stat().st_mtime_ns)
        if found:
            self._replacing.open(load_document(found[-1]), found[-1], recent=str(found[-1]))

    def open_room(self) -> None:
        """Open another room."""
        self._number += 1
        self._replacing.open(Document(f"room-{self._number}"), recent=f"room-{self._number}")

    def open_bad_room(self) -> None:
        """Open what cannot be read."""
        self._replacing.open(Document(BAD), recent=BAD)

    def begin_anew(self) -> None:
        """A new project in the same room."""
        self._replacing.open_in_room(Document(self.bench.document.scene))

    def answer(self, answer: Answer) -> None:
        """Answer the question that is asked, if one is."""
        asked, self._question = self._question, None
        if asked is None:
            return
        if answer is Answer.DISCARD:
            self._safe.append(self.bench.document)
        asked(answer)

    def rehearse(self) -> None:
        """Play the scenario."""
        self._refused(self.run.rehearse)

    def go_live(self) -> None:
        """Begin a live session."""
        if not self.run.is_busy and not self.run.is_playing:
            folder = self.run.new_folder("live")
            from studio.session.plan import SessionPlan

            self.run.play(StagedLive("first", SessionPlan(), folder, keeps=True))

    def stop(self) -> None:
        """Stop what runs."""
        self.run.stop()

    def end_job(self) -> None:
        """Let come to its end whatever runs."""
        self._end(fails=False)

    def fail_job(self) -> None:
        """Let fail whatever runs."""
        self._end(fails=True)

    def show_frame(self) -> None:
        """A session shows a frame, or the timeline an instant."""
        if self.bench.standing.mode is not Mode.EDITING:
            self.bench.show_state(SceneState())

    def open_recording(self) -> None:
        """Open the newest session."""
        kept = self.run.folders.listed(self.bench.project)
        if kept:
            self._refused(lambda: self.bench.open_recording(kept[0].recording))

    def close_recording(self) -> None:
        """Close it."""
        self._refused(lambda: self.bench.open_recording(None))

    def delete_session(self) -> None:
        """Delete the oldest session, and bring it back half of the time."""
        kept = self.run.folders.listed(self.bench.project)
        if not kept:
            return
        oldest = kept[-1]
        if self.bench.recording is not None and oldest.recording == self.bench.recording:
            self.bench.open_recording(None)
        self.run.folders.delete(oldest.folder)
        self._number += 1
        if self._number % 2 and len(kept) < MAX_SESSIONS:
            self.run.folders.undo_delete()
        else:
            self._forget(oldest.folder)

    # --- what must hold --------------------------------------------------------------------------

    def check(self) -> None:
        """Nothing on the disk was overwritten, and the mode suits what is shown."""
        for path, stamp in self._seen.items():
            if not path.exists() or _stamp(path) != stamp:
                self.lost.append(f"{path.name}: overwritten")
        self._seen |= {
            path: _stamp(path)
            for path in self._folder.rglob("*")
            if path.is_file() and path.name == RECORDING and ".deleted" not in str(path)
        }
        bench = self.bench
        if bench.standing.mode is Mode.EDITING and not bench.is_by_hand:
            self.lost.append("the twin is locked while nothing plays")
        if bench.standing.is_session and not self.run.is_busy:
            self.lost.append("a session that is over still plays")

    def finish(self) -> None:
        """Stop, close, and see whether the twin is the user's again."""
        while self.run.is_busy or self.run.is_playing:
            self.stop()
            self.end_job()
        self.answer(Answer.CANCEL)
        self.close_recording()
        self.edit()
        if not self.bench.is_by_hand or self.bench.is_saved:
            self.lost.append("the twin cannot be used in the end")
        self.check()

    def _ask(self, _name: str, answered: Callable[[Answer], None]) -> None:
        if self._question is None:  # a second one finds the window blocked by the first
            self._question = answered

    def _on_document(self) -> None:
        self._before = self.bench.document

    def _on_opened(self) -> None:
        if not any(document is self._before for document in self._safe):
            self.lost.append(f"edits of {self._before.scene} went without a question")
        self._safe = [self.bench.document]
        self._before = self.bench.document

    def _end(self, *, fails: bool) -> None:
        job = self.run.job
        if isinstance(job, StagedJob) and job.is_running:
            job.finish(fails=fails)
        self.run.poll()

    def _refused(self, action: Callable[[], object]) -> None:
        """Do it; a refusal must say in words why it cannot be done now."""
        try:
            action()
        except ValueError as error:
            if not str(error):
                self.lost.append("refused without a word")

    def _forget(self, folder: Path) -> None:
        self._seen = {p: s for p, s in self._seen.items() if not p.is_relative_to(folder)}


def _stamp(path: Path) -> tuple[int, int, int]:
    """A mark that tells a file from another one of its name."""
    found = path.stat()
    return found.st_ino, found.st_mtime_ns, found.st_size


ACTIONS: tuple[Callable[[Walk], None], ...] = (
    Walk.edit,
    Walk.undo,
    Walk.redo,
    Walk.save,
    Walk.open_project,
    Walk.open_room,
    Walk.open_bad_room,
    Walk.begin_anew,
    *(lambda walk, answer=answer: walk.answer(answer) for answer in Answer if answer != "keep"),
    Walk.rehearse,
    Walk.go_live,
    Walk.stop,
    Walk.end_job,
    Walk.fail_job,
    Walk.show_frame,
    Walk.open_recording,
    Walk.close_recording,
    Walk.delete_session,
)
"""All that can happen, each as likely as the others."""


def walked_rows(steps: int = STEPS, seed: int = 0) -> list[Row]:
    """Walk so many steps; how many ways between the modes were walked, and what was lost."""
    with tempfile.TemporaryDirectory(prefix="nexus-walk-") as folder:
        walk = walked(Path(folder), steps, Random(seed))
    for words in walk.lost[:10]:
        print(words)
    return [
        at_least("studio.states.walked", len(walk.bench.edges) / len(EDGES), "", bar=1.0),
        at_most("studio.states.lost", len(walk.lost), "", bar=0),
    ]


def walked(folder: Path, steps: int, random: Random) -> Walk:
    """A walk of so many random steps, checked after each."""
    walk = Walk(folder)
    for _ in range(steps):
        random.choice(ACTIONS)(walk)
        walk.check()
        if len(walk.run.folders.listed(walk.bench.project)) > MAX_SESSIONS:
            walk.delete_session()
    walk.finish()
    return walk
