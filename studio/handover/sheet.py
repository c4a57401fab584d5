"""The session sheet: one page that says what was played, how it went, and with what."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from devices.session_info import SessionInfo
from studio.console.rows import Row
from studio.reports.page import embedded_jpeg, page

WORDS: Mapping[str, str] = {
    "world_cm": "position",
    "yaw_deg": "yaw",
    "p95": "95 % below",
    "objects": "all moved objects",
    "visible": "while in sight",
    "paper": "the paper's method",
}
"""Parts of a figure's name, and what people call them."""

MAX_EVENTS = 40
"""On one page, chosen; the viewer and the report have them all."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """Contents of the sheet.

    Attributes:
        title: scene and scenario.
        verdict: whether the figures with a limit kept it, in words.
        facts: name and value: scene, when, seed, versions.
        figures: those with a bar first.
        events: (seconds, text).
        changes: what was changed while it ran, in words.
        pictures: (seconds, file) beside the sheet.
    """

    title: str
    verdict: str
    facts: tuple[tuple[str, str], ...]
    figures: tuple[Row, ...]
    events: tuple[tuple[float, str], ...]
    changes: tuple[str, ...]
    pictures: tuple[tuple[float, Path], ...]


def sheet_of(
    info: SessionInfo,
    rows: list[Row],
    *,
    recorded: datetime,
    seconds: float,
    frames: int,
    events: list[tuple[int, str]],
    pictures: list[tuple[float, Path]],
    notes: list[tuple[str, str]],
) -> Sheet:
    """The sheet of one session.

    Args:
        info: how it was made.
        rows: its figures.
        recorded: when the recording was written.
        seconds: how long it is.
        frames: tracked frames in it.
        events: (milliseconds, text).
        pictures: (seconds, file) out of the film.
        notes: more facts, name and value.
    """
    names = [info.scenario_name, *(change.scenario_name for change in info.changes)]
    story = " → ".join(name for name in names if name) or "none"
    facts = [
        ("scene", f"{info.scene} (sha256 {info.scene_hash[:16]})"),
        ("scenario", story),
        ("when", f"{recorded:%Y-%m-%d %H:%M} {recorded.tzname() or ''}".strip()),
        ("length", f"{seconds:.1f} s, {frames} frames, {info.fps:g} a second"),
        ("seed", "none: real devices" if info.seed is None else str(info.seed)),
        ("time", info.mode),
        ("trackers", ", ".join(info.methods)),
        *([("stands for the real room", info.reality)] if info.reality else []),
        *notes,
        ("versions", ", ".join(f"{name} {v}" for name, v in sorted(info.versions.items()))),
    ]
    barred = [row for row in rows if row.bar is not None]
    figures = [*barred, *(row for row in rows if row.bar is None and _is_shown(row))]
    return Sheet(
        title=f"{Path(info.scene).name} · {story}",
        verdict=_verdict(barred),
        facts=tuple(facts),
        figures=tuple(figures),
        events=tuple((t_ms / 1000.0, text) for t_ms, text in events[:MAX_EVENTS]),
        changes=_changes(info),
        pictures=tuple(pictures),
    )


def read_rows(path: Path) -> list[Row]:
    """The figures of a rehearsal's `report.json`.

    Raises:
        ValueError: the file is damaged.
        OSError: it cannot be read.
    """
    try:
        rows: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["rows"]
        return [
            Row(row["name"], row["value"], row["unit"], row["bar"], row["passed"]) for row in rows
        ]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: damaged: not a rehearsal's figures ({error})") from None


def sheet_html(sheet: Sheet) -> str:
    """The sheet as a page of its own, pictures inside."""
    pictures = [
        (t_s, embedded_jpeg(np.asarray(Image.open(file).convert("RGB"))))
        for t_s, file in sheet.pictures
    ]
    return page("session-sheet.html.j2").render(
        sheet=sheet, pictures=pictures, name=name_text, value=value_text, bar=bar_text
    )


def sheet_markdown(sheet: Sheet) -> str:
    """The sheet as Markdown; its pictures lie in the folder beside it."""
    lines = [f"# {_plain(sheet.title)}", "", f"**{sheet.verdict}**", ""]
    lines += ["| | |", "|---|---|"]
    lines += [f"| {_plain(name)} | {_plain(value)} |" for name, value in sheet.facts]
    if sheet.changes:
        lines += ["", "## Changes", "", *(f"- {_plain(change)}" for change in sheet.changes)]
    lines += ["", "## Figures", "", "| figure | value | limit | |", "|---|--:|--:|---|"]
    for row in sheet.figures:
        mark = {True: "✓ pass", False: "✗ fail", None: ""}[row.passed]
        lines.append(f"| {name_text(row)} | {value_text(row)} | {bar_text(row)} | {mark} |")
    if sheet.events:
        lines += ["", "## What happened", ""]
        lines += [f"- {t_s:.1f} s: {_plain(text)}" for t_s, text in sheet.events]
    if sheet.pictures:
        lines += ["", "## Pictures", ""]
        lines += [
            f"![the session at {t_s:.1f} s]({file.parent.name}/{file.name})"
            for t_s, file in sheet.pictures
        ]
    return "\n".join(lines) + "\n"


def value_text(row: Row) -> str:
    """A figure with its unit."""
    if row.value is None:
        return "not measured"
    number = f"{row.value:.0f}" if float(row.value).is_integer() else f"{row.value:.2f}"
    return f"{number} {unit_text(row)}".strip()


def unit_text(row: Row) -> str:
    """A figure's unit as it is printed."""
    return "°" if row.unit == "deg" else row.unit


def name_text(row: Row) -> str:
    """A figure's name in words: "chairs, position, mean"."""
    parts = row.name.removeprefix("rehearse.").split(".")
    return ", ".join(WORDS.get(part, part.replace("_", " ")) for part in parts)


def bar_text(row: Row) -> str:
    """The limit it is held to; empty where there is none."""
    return "" if row.bar is None else f"{row.bar:g} {unit_text(row)}".strip()


def _is_shown(row: Row) -> bool:
    """Single objects and durations are the report's."""
    return not row.name.startswith("stage.") and ".object." not in row.name


def _verdict(barred: list[Row]) -> str:
    missed = [name_text(row) for row in barred if row.passed is False]
    if not barred:
        return "Nothing was held to a limit"
    if not missed:
        return f"All {len(barred)} figures with a bar met it"
    return f"{len(missed)} of {len(barred)} figures miss their limit: {'; '.join(missed)}"


def _changes(info: SessionInfo) -> tuple[str, ...]:
    changes = [
        f"{change.t_ns / 1e9:g} s: the session went on with {change.scenario_name}"
        for change in info.changes
    ]
    if info.fork is not None:
        changes.insert(
            0,
            f"{info.fork.t_ns / 1e9:g} s: forked from {info.fork.recording} "
            f"(sha256 {info.fork.sha256[:16]})",
        )
    return tuple(changes)


def _plain(text: str) -> str:
    """Text in a Markdown table: no cell ends early, no line breaks."""
    return " ".join(text.replace("|", "\\|").split())
