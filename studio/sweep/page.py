"""The page of a sweep: for every fault, what its size does to the tracker."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from studio.console.machine import describe_machine
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG
from studio.reports.page import page
from studio.reports.report import METHOD_NAMES
from studio.sweep.chart import Series, chart
from studio.sweep.plan import WITHOUT, SweepPlan

Row = Mapping[str, Any]


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
