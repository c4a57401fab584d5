"""A whole rehearsal: play the session, score it, draw the film, write the report."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from devices.recording_codec import SessionInfo, track_to_json
from scenes.render.native import NativeRenderer
from scenes.state import LiveSurface, TrackedObject
from studio.console.progress import Progress
from studio.console.rows import Row, as_json, at_most
from studio.evaluate.filmed.perfect_detector import PerfectDetector
from studio.evaluate.scores import ScoreBoard, accuracy_rows
from studio.reports.film import FilmMaker, FilmTitle, Picture, write_film
from studio.reports.report import Report, render_report
from studio.session.live_surfaces import LiveSurfaces
from studio.session.outputs import FILM, RECORDING, REPORT_HTML, REPORT_JSON, TRACKS, output_folder
from studio.session.pipeline import CancelledError
from studio.session.session import Session, SessionOutput, SessionPlan, SessionResult, open_session
from studio.session.sources import recorded_messages
from studio.view.twin import Twin
from tracking.output import TrackOutput

STILLS = 8
"""Pictures of the film that the report shows."""

Watch = Callable[[SessionOutput], None]


@dataclass(frozen=True, slots=True)
class Performance:
    """What a rehearsal gave: the figures, and where the rest of it lies."""

    rows: list[Row]
    folder: Path


class Notes:
    """Everything the report needs of a session while it runs: tracks and scores by method."""

    def __init__(self, session: Session) -> None:
        self.boards = {name: ScoreBoard(session.scene.objects) for name in session.plan.methods}
        self.tracks: dict[str, list[tuple[TrackedObject, ...]]] = {
            name: [] for name in session.plan.methods
        }
        self.events: list[tuple[int, str]] = []
        self.shown: dict[int, TrackOutput] = {}

    def add(self, output: SessionOutput) -> None:
        """Take one frame."""
        self.events += [(e.t_ns, e.text) for e in output.input.events]
        self.shown[output.input.frame.seq] = output.shown
        for name, answer in output.tracks.items():
            self.tracks[name].append(answer.objects)
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
    verb: str = "rehearse",
) -> Performance:
    """Play a session and leave its results in a folder.

    Args:
        plan: what to play; where it is recorded is decided here.
        target: the folder, see `output_folder`.
        progress: told how far it is.
        opened: sees the session before it plays.
        watch: sees every result as it comes.
        cancelled: set it from another thread to stop.
        verb: written into the report.

    Raises:
        CancelledError: it was cancelled; nothing is left behind.
        ValueError, OSError: an input is bad, the target is not ours, or the disk is full.
    """
    cancelled = cancelled or threading.Event()
    with output_folder(target) as part:
        progress.begin("opening the scene (a built-in one is scanned the first time)")
        if plan.recording is None:
            plan = replace(plan, record_to=part / RECORDING)
        # The paper's trained network cannot be shipped: its best possible masks stand in for it.
        detector = PerfectDetector() if plan.recording is None else None
        session = open_session(plan, truth_detector=detector)
        progress.finish()
        if opened is not None:
            opened(session)
        notes = Notes(session)
        result = _play(session, notes, progress, watch, cancelled)
        rows = result_rows(session, notes, result)
        recording = plan.recording or part / RECORDING
        stills = _film(session, notes, recording, part / FILM, progress, cancelled)
        _write_tracks(part / TRACKS, session.info, notes)
        report = Report(
            verb=verb,
            session=session,
            boards=notes.boards,
            events=tuple(notes.events),
            result=result,
            rows=rows,
            stills=stills,
        )
        (part / REPORT_HTML).write_text(render_report(report), encoding="utf-8")
        values = as_json(verb, rows, session.info.seed)
        (part / REPORT_JSON).write_text(json.dumps(values, indent=2) + "\n", encoding="utf-8")
    return Performance(rows, target)


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
    progress: Progress,
    watch: Watch | None,
    cancelled: threading.Event,
) -> SessionResult:
    progress.begin("playing the session")
    started = time.monotonic()

    def see(output: SessionOutput) -> None:
        notes.add(output)
        if watch is not None:
            watch(output)
        t_ns = output.input.frame.t_ns
        whole_s = session.duration_ns / 1e9
        detail = f"{t_ns / 1e9:.1f} of {whole_s:.0f} s" if whole_s else f"{t_ns / 1e9:.1f} s"
        progress.advance(t_ns / session.duration_ns if session.duration_ns else 0.0, detail)

    result = session.run(see, cancelled=cancelled)
    rate = result.frames / max(time.monotonic() - started, 1e-9)
    progress.finish(f"{result.frames} frames, {rate:.1f} a second")
    return result


def _film(
    session: Session,
    notes: Notes,
    recording: Path,
    target: Path,
    progress: Progress,
    cancelled: threading.Event,
) -> list[tuple[float, Picture]]:
    """Draw the film from the recording; returns some of its pictures with their times."""
    progress.begin("drawing the film")
    info = session.info
    title = FilmTitle(info.scene, _story(info))
    maker = FilmMaker(session.scene, Twin(session.scene, NativeRenderer()), title)
    wanted = _evenly(sorted(notes.shown), STILLS)
    live_surfaces, surfaces = LiveSurfaces(session.scene), dict[str, LiveSurface]()
    stills: list[tuple[float, Picture]] = []

    def pictures() -> Iterator[Picture]:
        for count, message in enumerate(recorded_messages(recording, info)):
            if cancelled.is_set():
                raise CancelledError
            surfaces.update((s.surface_id, s) for s in message.input.surfaces)
            answer = notes.shown.get(message.frame.seq)
            if answer is None:
                continue
            tracks = {track.object_id: track for track in answer.objects}
            live = live_surfaces.step(message.frame, surfaces, answer)
            picture = maker.picture(message, tracks, live)
            if message.frame.seq in wanted:
                stills.append((message.frame.t_ns / 1e9, picture))
            progress.advance(count / len(notes.shown))
            yield picture

    count = write_film(target, pictures(), info.fps)
    progress.finish(f"{count} pictures")
    return stills


def _story(info: SessionInfo) -> str:
    seed = "" if info.seed is None else f" · seed {info.seed}"
    return f"{info.scenario_name}{seed} · tracker: {info.methods[0]}"


def _evenly(values: list[int], count: int) -> set[int]:
    last = len(values) - 1
    return {values[round(i * last / max(count - 1, 1))] for i in range(count)} if values else set()


def _write_tracks(path: Path, info: SessionInfo, notes: Notes) -> None:
    """Every pose of every method; `world_from_object` is a 4×4 row-major matrix in metres."""
    methods: dict[str, list[dict[str, Any]]] = {}
    for name, frames in notes.tracks.items():
        methods[name] = [
            {
                "seq": frame[0].source_seq,
                "t_ns": frame[0].t_ns,
                "objects": [track_to_json(track) for track in frame],
            }
            for frame in frames
            if frame
        ]
    values = {
        "format": "gaussiannexus tracks",
        "version": 1,
        "units": {"length": "m", "time": "ns"},
        "scene": info.scene,
        "scenario": info.scenario_name,
        "seed": info.seed,
        "methods": methods,
    }
    path.write_text(json.dumps(values, allow_nan=False) + "\n", encoding="utf-8")
