"""The folder of a rehearsal or live session as a page for a text browser: figures and pictures."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any, cast

from studio.console.spoken import UNITS, Called, spoken
from studio.live.report import REPORT_HTML as LIVE_HTML
from studio.live.report import REPORT_JSON as LIVE_JSON
from studio.session.records.outputs import REPORT_HTML, REPORT_JSON

PICTURE_WIDTH_PX = 320


def is_live(folder: Path) -> bool:
    """Whether a live session left its report in a folder, and no rehearsal."""
    return (folder / LIVE_JSON).is_file() and not (folder / REPORT_JSON).is_file()


def browser_page(folder: Path) -> Path:
    """The report of a folder for a browser."""
    return folder / (LIVE_HTML if is_live(folder) else REPORT_HTML)


def report_page(folder: Path, called: Called = str) -> str:
    """Simple HTML of a folder's report and pictures; says so where it is damaged.

    Args:
        folder: of the session.
        called: what the object of an id is called.
    """
    name = LIVE_JSON if is_live(folder) else REPORT_JSON
    try:
        values: dict[str, Any] = dict(json.loads((folder / name).read_text("utf-8")))
        rows = [dict(row) for row in values["rows"]]
    except (OSError, ValueError, TypeError, KeyError) as error:
        what = f"{folder.name}: its {name} cannot be read ({error}). Rehearse again."
        return f"<p>✖ {html.escape(what)}</p>"
    lines = [_line(row, called) for row in rows]
    pictures = "".join(
        f'<p><img src="{path.resolve().as_uri()}" width="{PICTURE_WIDTH_PX}"/></p>'
        for path in sorted(folder.glob("*.png"))
    )
    missed = sum(row.get("passed") is False for row in rows)
    held = sum(row.get("passed") is not None for row in rows)
    verdict = f"✖ {missed} of {held} limits missed" if missed else f"✓ all {held} limits kept"
    if not held:
        verdict = "nothing here is held to a limit"
    head = "<tr><th align=left>Figure</th><th align=right>Value</th><th align=left></th>"
    return (
        f"<h3>{html.escape(folder.name)}</h3><p>{verdict}</p>"
        f"<table cellspacing=0 cellpadding=3 width='99%'>{head}"
        f"<th align=right>Limit</th><th></th></tr>{''.join(lines)}</table>{pictures}"
        f"{_texts('Changes', values)}{_texts('Events', values)}"
    )


def _texts(title: str, values: dict[str, Any]) -> str:
    """Changes by people or events, a line each; empty where the report has none."""
    found = values.get(title.lower())
    if not isinstance(found, list) or not found:
        return ""
    lines = cast("list[dict[str, Any]]", found)
    begun_ns = min(int(each.get("t_ns", 0)) for each in cast("list[Any]", lines))
    rows = "".join(
        f"<tr><td align=right>{(int(line.get('t_ns', 0)) - begun_ns) / 1e9:.1f} s</td>"
        f"<td>{html.escape(str(line.get('text', '')))}</td></tr>"
        for line in lines
    )
    return f"<h4>{title}</h4><table cellspacing=0 cellpadding=3 width='100%'>{rows}</table>"


def _line(row: dict[str, Any], called: Called) -> str:
    passed = row.get("passed")
    unit = str(row.get("unit") or "")
    mark = "" if passed is None else "✓" if passed else "✖"
    cells = (
        ("left", spoken(str(row.get("name", "")), called)),
        ("right", _number(row.get("value"))),
        ("left", UNITS.get(unit, unit)),
        ("right", "" if row.get("bar") is None else _number(row.get("bar"))),
        ("left", mark),
    )
    inner = "".join(f"<td align={side}>{html.escape(text)}</td>" for side, text in cells)
    return f"<tr>{inner}</tr>"


def _number(value: object) -> str:
    if not isinstance(value, int | float):
        return "–"
    return f"{value:.0f}" if value == round(value) else f"{value:.2f}"
