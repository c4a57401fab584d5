"""A rehearsal's folder as a page that a text browser can show: figures and pictures."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

from studio.session.outputs import REPORT_JSON

PICTURE_WIDTH_PX = 320


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
    verdict = f"✖ {missed} of {held} bars missed" if missed else f"✓ all {held} bars met"
    head = "<tr><th align=left>Figure</th><th align=right>Value</th><th align=left></th>"
    return (
        f"<h3>{html.escape(folder.name)}</h3><p>{verdict}</p>"
        f"<table cellspacing=0 cellpadding=3 width='100%'>{head}"
        f"<th align=right>Bar</th><th></th></tr>{''.join(lines)}</table>{pictures}"
    )


def _line(row: dict[str, Any]) -> str:
    passed = row.get("passed")
    mark = "" if passed is None else "✓" if passed else "✖"
    cells = (
        ("left", str(row.get("name", ""))),
        ("right", _number(row.get("value"))),
        ("left", str(row.get("unit") or "")),
        ("right", "" if row.get("bar") is None else _number(row.get("bar"))),
        ("left", mark),
    )
    inner = "".join(f"<td align={side}>{html.escape(text)}</td>" for side, text in cells)
    return f"<tr>{inner}</tr>"


def _number(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, int | float) else "-"
