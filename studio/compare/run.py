"""One rehearsal or fork as a comparison needs it: read from the folder it left behind."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import groupby
from pathlib import Path
from typing import Any

from devices.messages import Event
from devices.recording import read_recording, read_session
from devices.recording_codec import RecordedTrack, RecordedTruth, RecordedValue
from devices.session_info import SessionInfo
from scenes.package import ScenePackage
from studio.console.rows import Row
from studio.evaluate.scores import ScoreBoard
from studio.session.pipeline import time_ns_of
from studio.session.records.outputs import FILM, RECORDING, REPORT_JSON

LOST = "dropped"
"""Kind of the events that say that a frame was lost: too many to show one by one."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One side of a comparison.

    Attributes:
        name: "A" or "B".
        folder: where it lies.
        verb: "rehearse" or "fork".
        info: how it was made.
        rows: its figures.
        board: poses and truth of the method that was shown.
        events: (t_ns, text) of what happened, without lost frames.
        frames_s: times of the film's pictures, seconds of the session.
        recording_sha256: of the recording's content, hexadecimal.
        film: the film, or None where there is none.
    """

    name: str
    folder: Path
    verb: str
    info: SessionInfo
    rows: tuple[Row, ...]
    board: ScoreBoard
    events: tuple[tuple[int, str], ...]
    frames_s: tuple[float, ...]
    recording_sha256: str
    film: Path | None

    @property
    def scenario(self) -> str:
        """Text of the scenario that was followed last."""
        return self.info.changes[-1].scenario if self.info.changes else self.info.scenario

    @property
    def scenario_names(self) -> str:
        """Names of the scenarios that were followed, one after the other."""
        names = [self.info.scenario_name, *(c.scenario_name for c in self.info.changes)]
        return " → ".join(names) or "none"

    @property
    def fork_s(self) -> float | None:
        """When the fork begins, seconds; None of a rehearsal."""
        return None if self.info.fork is None else self.info.fork.t_ns / 1e9


def what_is_missing(folder: Path) -> str | None:
    """Why a folder cannot be compared, in words; None if it can be tried."""
    if not folder.is_dir():
        return f"{folder}: no such folder; wanted one that 'nexus rehearse' or 'nexus fork' left"
    for name in (REPORT_JSON, RECORDING):
        if not (folder / name).is_file():
            return (
                f"{folder}: holds no {name}; wanted a folder that 'nexus rehearse' or "
                "'nexus fork' left"
            )
    return None


def read_run(name: str, folder: Path, info: SessionInfo, scene: ScenePackage) -> Run:
    """Read one side.

    Args:
        name: "A" or "B".
        folder: that a rehearsal or a fork left.
        info: of its recording.
        scene: with the objects that moved.

    Raises:
        ValueError: a file in it is damaged.
        OSError: a file cannot be read.
    """
    report = _report(folder / REPORT_JSON)
    board = ScoreBoard(scene.objects)
    events: list[tuple[int, str]] = []
    frames_s: list[float] = []
    for t_ns, values in _moments(folder / RECORDING):
        events += [(v.t_ns, v.text) for v in values if isinstance(v, Event) and v.kind != LOST]
        tracks = [
            v.track for v in values if isinstance(v, RecordedTrack) and v.method == info.methods[0]
        ]
        if tracks:
            frames_s.append(t_ns / 1e9)
        for truth in values:
            if isinstance(truth, RecordedTruth) and tracks:
                board.add(tracks, truth)
    with (folder / RECORDING).open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    film = folder / FILM
    return Run(
        name=name,
        folder=folder,
        verb=str(report["verb"]),
        info=info,
        rows=tuple(_rows(folder / REPORT_JSON, report)),
        board=board,
        events=tuple(events),
        frames_s=tuple(frames_s),
        recording_sha256=digest,
        film=film if film.is_file() else None,
    )


def read_info(folder: Path) -> SessionInfo:
    """How a run was made.

    Raises:
        RecordingError: its recording is damaged.
        OSError: it cannot be read.
    """
    return read_session(folder / RECORDING)


def read_board(recording: Path, scene: ScenePackage) -> ScoreBoard:
    """Poses and truth of the method that was shown, of one recording; empty without a truth.

    Args:
        recording: file of a session.
        scene: with the objects that moved.

    Raises:
        RecordingError: it is damaged.
        OSError: it cannot be read.
    """
    shown = next(iter(read_session(recording).methods), "")
    board = ScoreBoard(scene.objects)
    for _, values in _moments(recording):
        tracks = [v.track for v in values if isinstance(v, RecordedTrack) and v.method == shown]
        for truth in values:
            if isinstance(truth, RecordedTruth) and tracks:
                board.add(tracks, truth)
    return board


def _moments(recording: Path) -> Iterator[tuple[int, list[RecordedValue]]]:
    for t_ns, group in groupby(read_recording(recording), key=time_ns_of):
        yield t_ns, list(group)


def _report(path: Path) -> dict[str, Any]:
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: damaged: not JSON ({error}); rehearse again") from None
    if not isinstance(report, dict) or "verb" not in report or "rows" not in report:
        raise ValueError(f"{path}: not a report of a rehearsal: it has no verb or rows")
    return report


def _rows(path: Path, report: dict[str, Any]) -> list[Row]:
    names = [field.name for field in fields(Row)]
    try:
        return [Row(**{name: row[name] for name in names}) for row in report["rows"]]
    except (KeyError, TypeError):
        raise ValueError(f"{path}: damaged: a row lacks one of {', '.join(names)}") from None
