"""The page of a sweep: for every fault, what its size does to the tracker."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from statistics import median
from typing import Any

from studio.console.machine import describe_machine
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG
from studio.reports.page import page
from studio.reports.report import METHOD_NAMES
from studio.sweep.plan import WITHOUT, SweepPlan

Row = Mapping[str, Any]

WIDTH, HEIGHT = 460, 250

LEFT, RIGHT, TOP, BOTTOM = 52, 14, 14, 40

HEADROOM = 1.08
"""The highest value stands this far below the top."""

TICKS = 5

Placed = Callable[[float], float]
"""A value's place on an axis, in the drawing's units."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One plot: the rows' keys that it shows, the first as its main line."""

    title: str
    unit: str
    keys: tuple[str, ...]
    floor: float
    scale: float = 1.0


FIGURES = (
    Figure("Position error", "cm", ("world_cm_mean", "world_cm_p95"), 1.0),
    Figure("Yaw error", "°", ("yaw_deg_mean", "yaw_deg_p95"), 1.0),
    Figure("Position error as shown", "cm", ("shown_cm_mean", "shown_cm_p95"), 1.0),
    Figure("Time lost", "%", ("lost_share",), 10.0, 100.0),
)
"""Figures that are drawn for every fault."""


def sweep_page(plan: SweepPlan, rows: Sequence[Row]) -> str:
    """The page as HTML, with nothing beside it.

    Args:
        plan: what was played.
        rows: one a run and tracker, as `studio.sweep.play` gives them.
    """
    methods = list(dict.fromkeys(row["method"] for row in rows))
    faults = [name for name in dict.fromkeys(row["fault"] for row in rows) if name != WITHOUT]
    without = [row for row in rows if row["fault"] == WITHOUT]
    return page("sweep.html.j2").render(
        plan=plan,
        scene=plan.runs[0].scene,
        seeds=sorted({row["seed"] for row in rows}),
        methods=[(name, METHOD_NAMES.get(name, name)) for name in methods],
        without=[_cells(name, "", _of(without, name)) for name in methods],
        faults=[
            _section([row for row in rows if row["fault"] == name], without, methods)
            for name in faults
        ],
        room_bar_cm=ROOM_BAR_CM,
        room_bar_deg=ROOM_BAR_DEG,
        machine=describe_machine(),
    )


def _section(rows: Sequence[Row], without: Sequence[Row], methods: Sequence[str]) -> dict[str, Any]:
    """One fault: its plots and its table."""
    name, unit = rows[0]["fault"], rows[0]["unit"]
    words = _words(name)
    label = words if unit in words.split() else f"{words} ({unit})"
    sizes = sorted({row["size"] for row in rows})
    return {
        "name": words,
        "charts": [
            (f"{figure.title} ({figure.unit})", _chart(figure, rows, without, methods, label))
            for figure in FIGURES
        ],
        "lines": [
            _cells(method, f"{size:g} {unit}", _of([r for r in rows if r["size"] == size], method))
            for size in sizes
            for method in methods
        ],
    }


def _words(fault: str) -> str:
    """A fault's name for people; its unit stands beside it."""
    return re.sub("_(ms|ppm|deg|cm)$", "", fault).replace("_", " ")


def _chart(
    figure: Figure,
    rows: Sequence[Row],
    without: Sequence[Row],
    methods: Sequence[str],
    label: str,
) -> str:
    def numbers(some: Sequence[Row], key: str) -> list[float]:
        return [figure.scale * row[key] for row in some if row[key] is not None]

    series = [
        Series(
            method,
            place == 0,
            {
                size: numbers([r for r in _of(rows, method) if r["size"] == size], key)
                for size in sorted({row["size"] for row in rows})
            },
            numbers(_of(without, method), key) if place == 0 else (),
        )
        for method in methods
        for place, key in enumerate(figure.keys)
    ]
    value_label = f"{figure.title} ({figure.unit})"
    return chart(series, size_label=label, value_label=value_label, floor=figure.floor)


def _of(rows: Sequence[Row], method: str) -> list[Row]:
    return [row for row in rows if row["method"] == method]


def _cells(method: str, size: str, rows: Sequence[Row]) -> dict[str, str]:
    """One line of a table: medians over the seeds."""

    def middle(key: str, scale: float = 1.0, digits: int = 1) -> str:
        values = [scale * row[key] for row in rows if row[key] is not None]
        return f"{median(values):.{digits}f}" if values else "–"

    return {
        "size": size,
        "method": METHOD_NAMES.get(method, method),
        "world": middle("world_cm_mean"),
        "world_p95": middle("world_cm_p95"),
        "yaw": middle("yaw_deg_mean"),
        "yaw_p95": middle("yaw_deg_p95"),
        "shown": middle("shown_cm_mean"),
        "lost": middle("lost_share", 100.0, 0),
        "frames": middle("frames", 1.0, 0),
        "seeds": str(len(rows)),
    }


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a plot.

    Attributes:
        tracker: colours it.
        is_strong: a full line; otherwise a thin dashed one, with hollow points.
        values: of each seed, by size; sizes without any value have no point.
        without: of each seed, without the fault.
    """

    tracker: str
    is_strong: bool
    values: Mapping[float, Sequence[float]]
    without: Sequence[float]


def chart(series: Sequence[Series], *, size_label: str, value_label: str, floor: float) -> str:
    """The plot; its colours come from the page.

    Args:
        series: at least one.
        size_label: what runs along, with its unit.
        value_label: what runs up, with its unit.
        floor: the vertical axis reaches at least here.
    """
    sizes = sorted({size for one in series for size in one.values})
    highest = max(
        [v for one in series for vs in (*one.values.values(), one.without) for v in vs],
        default=0.0,
    )
    top = HEADROOM * max(highest, floor)
    low, high = min(0.0, *sizes), max(0.0, *sizes)
    high = high if high > low else low + 1.0

    def x(size: float) -> float:
        return LEFT + (size - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        return HEIGHT - BOTTOM - value / top * (HEIGHT - TOP - BOTTOM)

    parts = [_frame(top, y), _along(sizes, x)]
    for one in series:
        parts.append(_drawn(one, x, y))
    middle = LEFT + 0.5 * (WIDTH - LEFT - RIGHT)
    parts.append(f'<text class="label" x="{middle:g}" y="{HEIGHT - 6}">{escape(size_label)}</text>')
    title = escape(f"{value_label} against {size_label}")
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}">'
        f"<title>{title}</title>{''.join(parts)}</svg>"
    )


def _frame(top: float, y: Placed) -> str:
    step = _round_step(top / TICKS)
    lines: list[str] = []
    for k in range(int(top / step) + 1):
        at, value = y(k * step), k * step
        lines.append(_level("grid", at))
        lines.append(f'<text class="up" x="{LEFT - 6}" y="{at + 4:.1f}">{value:.4g}</text>')
    return "".join(lines)


def _level(kind: str, at: float) -> str:
    ends = f'x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"'
    return f'<line class="{kind}" {ends}/>'


def _along(sizes: Sequence[float], x: Placed) -> str:
    return "".join(
        f'<text class="along" x="{x(size):.1f}" y="{HEIGHT - BOTTOM + 16}">{size:g}</text>'
        for size in sizes
    )


def _drawn(one: Series, x: Placed, y: Placed) -> str:
    name = f"{escape(one.tracker)}{'' if one.is_strong else ' weak'}"
    parts: list[str] = []
    if one.without:
        at = y(median(one.without))
        parts.append(_level("without", at))
    middles = [(x(s), y(median(v))) for s, v in sorted(one.values.items()) if v]
    if len(middles) > 1:
        way = " ".join(f"{a:.1f},{b:.1f}" for a, b in middles)
        parts.append(f'<polyline points="{way}"/>')
    for size, values in sorted(one.values.items()):
        for value in values:
            parts.append(
                f'<circle cx="{x(size):.1f}" cy="{y(value):.1f}" r="3.5">'
                f"<title>{size:g}: {value:.3g}</title></circle>"
            )
    return f'<g class="series {name}">{"".join(parts)}</g>'


def _round_step(step: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** len(str(int(step))) / 10.0 if step >= 1.0 else 1.0
    while power > step:
        power /= 10.0
    return next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= step - 1e-12)
