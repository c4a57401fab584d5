"""A whole rehearsal: play the session and draw its film, score it, write the report."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from devices.session_info import SessionInfo
from scenes.render.native import NativeRenderer
from studio.console.progress import Progress
from studio.console.rows import Row, as_json, at_most
from studio.evaluate.perfect_detector import PerfectDetector
from studio.evaluate.scores import ScoreBoard, accuracy_rows
from studio.reports.film import FilmMaker, FilmTitle, Picture, film_frame
from studio.reports.film_file import FilmFile, FilmThread
from studio.reports.report import Report, render_report
from studio.reports.tracks_file import TracksFile
from studio.session.opening import open_session
from studio.session.pipeline import CancelledError
from studio.session.plan import Pace, SessionPlan
from studio.session.records.outputs import (
    FILM,
    RECORDING,
    REPORT_HTML,
    REPORT_JSON,
    SCENARIO,
    TRACKS,
    output_folder,
)
from studio.session.session import Session, SessionOutput, SessionResult
from studio.view.twin import Twin

STILLS = 8
"""Pictures of the film that the report shows, chosen: four rows of two."""

Watch = Callable[[SessionOutput], None]


@dataclass(frozen=True, slots=True)
class Performance:
    """Results of a rehearsal: the figures, and the folder of the rest."""

    rows: list[Row]
    folder: Path
    cut_short: str = ""
    """When it was stopped, in words; empty if it was played to its end."""


class Notes:
    """Everything the report needs of a session while it runs: scores by method, what happened.

    Args:
        session: whose frames come.
        tracks: where every method's poses go.
    """

    def __init__(self, session: Session, tracks: TracksFile) -> None:
        self.boards = {name: ScoreBoard(session.scene.objects) for name in session.plan.methods}
        self.events: list[tuple[int, str]] = []
        self._tracks = tracks

    def add(self, output: SessionOutput) -> None:
        """Take one frame."""
        self.events += [(e.t_ns, e.text) for e in output.input.events]
        for name, answer in output.tracks.items():
            self._tracks.add(name, answer.objects)
            if output.message.truth is not None:
                self.boards[name].add(answer.objects, output.message.truth.recorded)


def perform(
    plan: SessionPlan,
    target: Path,
    *,
    progress: Progress,
    opened: Callable[[Session], None] | None = None,
    watch: Watch | None = None,
    cancelled: threading.Event | None = None,
    stopped: threading.Event | None = None,
    verb: str | None = None,
) -> Performance:
    """Play a session and leave its results in a folder.

    Args:
        plan: what to play; where it is recorded is decided here.
        target: the folder, see `output_folder`.
        progress: shows how far it is.
        opened: sees the session before it plays.
        watch: sees every result as it comes.
        cancelled: set it from another thread to stop and leave nothing.
        stopped: set it from another thread to stop and leave what was played until then, marked as
            cut short.
        verb: written into the report; "replay", "fork" or "rehearse" if None.

    Raises:
        CancelledError: it was cancelled, or stopped before anything of its own was played; nothing
            is left behind.
        ValueError, OSError: an input is bad, the target is not ours, or the disk is full.
    """
    cancelled = cancelled or threading.Event()
    verb = verb or ("replay" if plan.recording else "rehearse" if plan.fork is None else "fork")
    with output_folder(target) as part:
        progress.begin("opening the scene (the first time takes some minutes)")
        plan = replace(plan, record_to=part / RECORDING)
        # The paper's trained network cannot be shipped: its best possible masks stand in for it.
        detector = PerfectDetector() if plan.recording is None else None
        session = open_session(plan, truth_detector=detector)
        progress.finish()
        if opened is not None:
            opened(session)
        with TracksFile(part / TRACKS, session.info, plan.methods) as tracks:
            notes = Notes(session, tracks)
            ends = _Ends(cancelled, stopped or threading.Event())
            result, stills = _play(session, notes, part / FILM, progress, watch, ends)
        rows = result_rows(session, notes, result)
        if session.info.scenario:
            (part / SCENARIO).write_text(session.info.scenario, encoding="utf-8")
        _write_report(
            Report(
                verb=verb,
                session=session,
                boards=notes.boards,
                events=_events(session.info, notes, result),
                result=result,
                rows=rows,
                stills=stills,
            ),
            part,
        )
    return Performance(rows, target, "" if result.cut_short is None else result.cut_short.text)


def _write_report(report: Report, folder: Path) -> None:
    """Write a report as a page, and its figures as JSON."""
    info, cut_short = report.session.info, report.result.cut_short
    (folder / REPORT_HTML).write_text(render_report(report), encoding="utf-8")
    values = as_json(report.verb, list(report.rows), info.seed)
    if cut_short is not None:
        values["cut_short"] = cut_short.text
    if info.fork is not None:
        values["fork"] = asdict(info.fork)
    (folder / REPORT_JSON).write_text(json.dumps(values, indent=2) + "\n", encoding="utf-8")


@dataclass(frozen=True, slots=True)
class _Ends:
    """How a session is ended from another thread: nothing is kept, or what was played."""

    cancelled: threading.Event
    stopped: threading.Event


def _check_worth(session: Session, result: SessionResult) -> None:
    """Refuse to keep what was stopped before it had begun.

    Raises:
        CancelledError: nothing was played, or of a fork only what the recording before it holds.
    """
    if result.cut_short is None:
        return
    fork = session.plan.fork
    if not result.frames or (fork is not None and result.cut_short.t_ns <= fork.t_ns):
        raise CancelledError


def result_rows(session: Session, notes: Notes, result: SessionResult) -> list[Row]:
    """The figures of a session: accuracy of every method, dropped frames, durations."""
    shown, *others = session.plan.methods
    rows = accuracy_rows(notes.boards[shown])
    rows.append(Row("rehearse.frames", float(result.frames), ""))
    rows.append(at_most("rehearse.frames_dropped", result.dropped, "", bar=0))
    rows.append(Row("rehearse.frames_lost_on_the_way", float(result.lost), ""))
    for name in others:
        rows += accuracy_rows(notes.boards[name], prefix=f"rehearse.{name}", bars=False)
    return rows + result.latencies.rows()


def _play(
    session: Session,
    notes: Notes,
    film_path: Path,
    progress: Progress,
    watch: Watch | None,
    ends: _Ends,
) -> tuple[SessionResult, list[tuple[float, Picture]]]:
    """Play the session and draw its film meanwhile; also gives the film's stills.

    At a session's own pace the film is drawn in line, and no stage is timed while it is. In real
    time it is drawn on a thread behind a queue, and frames for which that has no room are left out.
    """
    progress.begin("playing the session, drawing the film")
    started = time.monotonic()
    info = session.info
    maker = FilmMaker(
        session.scene,
        Twin(session.scene, NativeRenderer()),
        FilmTitle(
            Path(info.scene).name, _story(info), None if info.fork is None else info.fork.t_ns
        ),
    )
    film = FilmFile(film_path, maker, info.fps, stills=STILLS)
    thread = FilmThread(film) if session.plan.pace is Pace.PACED else None

    def see(output: SessionOutput) -> None:
        notes.add(output)
        if watch is not None:
            watch(output)
        (thread or film).add(film_frame(output))
        t_ns = output.input.frame.t_ns
        whole_s = session.duration_ns / 1e9
        detail = f"{t_ns / 1e9:.1f} of {whole_s:.0f} s" if whole_s else f"{t_ns / 1e9:.1f} s"
        progress.advance(t_ns / session.duration_ns if session.duration_ns else 0.0, detail)

    with film, thread or nullcontext():
        result = session.run(see, cancelled=ends.cancelled, stopped=ends.stopped)
        _check_worth(session, result)
    rate = result.frames / max(time.monotonic() - started, 1e-9)
    left_out = f", {thread.left_out} not in the film" if thread and thread.left_out else ""
    progress.finish(f"{result.frames} frames, {rate:.1f} a second{left_out}")
    return result, film.stills


def _story(info: SessionInfo) -> str:
    seed = "" if info.seed is None else f" · seed {info.seed}"
    names = " → ".join((info.scenario_name, *(change.scenario_name for change in info.changes)))
    return f"{names}{seed} · tracker: {info.methods[0]}"


def _events(info: SessionInfo, notes: Notes, result: SessionResult) -> tuple[tuple[int, str], ...]:
    """Return the events in order of time, with the fork's beginning and an early end."""
    if result.cut_short is not None:
        notes.events.append((result.cut_short.t_ns, result.cut_short.text))
    if info.fork is None:
        return tuple(notes.events)
    mark = (info.fork.t_ns, f"the fork of {info.fork.recording} begins")
    return tuple(sorted([mark, *notes.events], key=lambda event: event[0]))
