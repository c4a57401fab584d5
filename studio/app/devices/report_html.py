"""A rehearsal's folder as a page that a text browser can show: figures and pictures."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

from studio.session.outputs import REPORT_JSON

PICTURE_WIDTH_PX = 320
WORDS = {
    "world_cm": "place",
    "yaw_deg": "heading",
    "ms": "time",
    "mean": "mean",
    "p50": "usual",
    "p95": "95 %",
    "object": "",
    "rehearse": "",
    "stage": "step",
}
"""Parts of a figure's name as people say them; "" leaves a part out, others stay."""
UNITS = {"deg": "°"}


def report_page(folder: Path) -> str:
    """Simple HTML of `report.json` and of the pictures beside it; says so where it is damaged."""
    try:
        values: dict[str, Any] = dict(json.loads((folder / REPORT_JSON).read_text("utf-8")))
        rows = [dict(row) for row in values["rows"]]
    except (OSError, ValueError, TypeError, KeyError) as error:
        what = f"{folder.name}: its {REPORT_JSON} cannot be read ({error}). Rehearse again."
        return f"<p>✖ {html.escape(what)}</p>"
    lines = [_line(row) for row in rows]
    pictures = "".join(
        f'<p><img src="{path.resolve().as_uri()}" width="{PICTURE_WIDTH_PX}"/></p>'
        for path in sorted(folder.glob("*.png"))
    )
    missed = sum(row.get("passed") is False for row in rows)
    held = sum(row.get("passed") is not None for row in rows)
    verdict = f"✖ {missed} of {held} limits missed" if missed else f"✓ all {held} limits kept"
    head = "<tr><th align=left>Figure</th><th align=right>Value</th><th align=left></th>"
    return (
        f"<h3>{html.escape(folder.name)}</h3><p>{verdict}</p>"
        f"<table cellspacing=0 cellpadding=3 width='100%'>{head}"
        f"<th align=right>Limit</th><th></th></tr>{''.join(lines)}</table>{pictures}"
    )


def spoken(name: str) -> str:
    """A figure's name in words: `rehearse.chairs.world_cm.mean` is "chairs, place, mean"."""
    words = [WORDS.get(part, part.replace("_", " ")) for part in name.split(".")]
    return ", ".join(word for word in words if word)


def _line(row: dict[str, Any]) -> str:
    passed = row.get("passed")
    unit = str(row.get("unit") or "")
    mark = "" if passed is None else "✓" if passed else "✖"
    cells = (
        ("left", spoken(str(row.get("name", "")))),
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
