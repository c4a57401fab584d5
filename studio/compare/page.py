"""The page of a comparison, with its films beside it."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scenes.formats.storage.atomic import write_whole
from scenes.state import ObjectModel
from studio.compare.comparison import Comparison, kinship, scenario_difference
from studio.compare.error_map import error_maps, moved_objects
from studio.compare.run import Run
from studio.compare.verdicts import Compared
from studio.console.machine import describe_machine
from studio.console.spoken import Called, spoken, with_names
from studio.evaluate.figures import INK, OTHER, OWN, SMALLEST_SHOWN, as_svg, figure_style
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG
from studio.reports.floor_picture import floor_picture
from studio.reports.page import page

FILMS = "-films"
"""After the page's name without its ending: the folder beside it that holds copies of both films,
so that page and folder can be moved together and play without the runs."""

COPIED_BYTES = 1 << 20
"""Bytes of a film that are copied at a time."""

COLUMNS = (
    ("world_cm", ROOM_BAR_CM, "cm", "position error"),
    ("yaw_deg", ROOM_BAR_DEG, "°", "yaw error"),
)

NUMBER_WIDTH = 0.025
"""Share of the time axis that an event's number covers, by its size in print; the numbers of
events that come sooner after one are left out."""


def write_comparison(comparison: Comparison, path: Path) -> None:
    """Write the page, and copies of the films beside it; the page comes last.

    Raises:
        OSError: it cannot be written.
    """
    films = path.with_name(path.stem + FILMS)
    path.parent.mkdir(parents=True, exist_ok=True)
    sources: dict[str, str] = {}
    for run in (comparison.a, comparison.b):
        if run.film is not None:
            films.mkdir(exist_ok=True)
            name = f"{run.name.lower()}.mp4"
            with run.film.open("rb") as film:
                write_whole(films / name, iter(lambda: film.read(COPIED_BYTES), b""))
            sources[run.name] = quote(f"{films.name}/{name}")
    write_whole(path, render_comparison(comparison, sources))


def render_comparison(comparison: Comparison, films: dict[str, str]) -> str:
    """The page as HTML.

    Args:
        comparison: what it shows.
        films: address of the film by the run's name, for those that have one.
    """
    a, b = comparison.a, comparison.b
    names = {item.object_id: item.name for item in comparison.scene.objects}

    def called(object_id: str) -> str:
        return names.get(object_id) or object_id

    return page("compare.html.j2").render(
        comparison=comparison,
        runs=(a, b),
        headline=headline(comparison),
        kinship=kinship(a, b),
        difference=scenario_difference(a, b),
        figures=[_cells(row, called) for row in comparison.rows if not _is_duration(row)],
        durations=[_cells(row, called) for row in comparison.rows if _is_duration(row)],
        worse=[(spoken(row.name, called), row) for row in comparison.worse],
        events={
            run.name: [(t_ns, with_names(text, names, called)) for t_ns, text in run.events]
            for run in (a, b)
        },
        maps=error_maps(comparison.scene, a, b, floor_picture(comparison.scene)),
        curves=error_curves(a, b),
        films=films,
        film_times={
            run.name: {"times": [round(t, 4) for t in run.frames_s], "fps": run.info.fps}
            for run in (a, b)
            if run.name in films
        },
        end_s=round(max((t for run in (a, b) for t in run.frames_s), default=0.0), 3),
        provenance=[(run, _provenance(run)) for run in (a, b)],
        machine=describe_machine(),
    )


def headline(comparison: Comparison) -> str:
    """The verdict in one line."""
    percent = f"{100 * comparison.tolerance:g} %"
    count = len(comparison.worse)
    if not count:
        return f"No figure got worse by more than {percent}"
    noun = "figure" if count == 1 else "figures"
    return f"{count} {noun} got worse by more than {percent}"


def _is_duration(row: Compared) -> bool:
    return row.name.startswith("stage.")


def _cells(row: Compared, called: Called) -> dict[str, str]:
    change = ""
    if row.difference is not None:
        change = f"{row.difference:+.3g}" if row.difference else "0"
        if row.a and row.difference:
            change += f" ({100 * row.difference / abs(row.a):+.0f} %)"
    marks = {"better": "pass", "worse": "fail"}
    return {
        "name": spoken(row.name, called),
        "unit": "°" if row.unit == "deg" else row.unit,
        "a": "–" if row.a is None else f"{row.a:.4g}",
        "b": "–" if row.b is None else f"{row.b:.4g}",
        "change": change,
        "verdict": row.verdict,
        "mark": marks.get(row.verdict, ""),
    }


def _provenance(run: Run) -> str:
    fork = run.info.fork
    if fork is None:
        return "a rehearsal from its start"
    return f"a fork of {fork.recording} (sha256 {fork.sha256[:16]}) at {fork.t_ns / 1e9:g} s"


def error_curves(a: Run, b: Run) -> str:
    """Position and yaw error of every object that moved in either run; empty if none did."""
    models = moved_objects((a, b))
    if not models:
        return ""
    with figure_style():
        height = 0.9 + 1.5 * len(models) + 0.9
        figure = Figure(figsize=(11, height), layout="constrained")
        ratios = [0.6, *(1.5 for _ in models)]
        grid = figure.subplots(len(models) + 1, 2, sharex=True, squeeze=False, height_ratios=ratios)
        for axes, (_column, _bar, _unit, title) in zip(grid[0], COLUMNS, strict=True):
            _draw_events(axes, a, b)
            axes.set_title(title, loc="right", fontsize=9)
        for row, model in zip(grid[1:], models, strict=True):
            for axes, (column, bar, unit, _title) in zip(row, COLUMNS, strict=True):
                _draw_errors(axes, (a, b), model, column=column, bar=bar)
                axes.set_ylabel(unit, rotation=0, labelpad=10)
            row[0].set_title(model.name, loc="left", fontsize=10, fontweight="bold")
        end_s = max((t for run in (a, b) for t in run.frames_s), default=0.0)
        for axes in grid.flat:
            axes.set_xlim(0.0, max(end_s, 0.1))
            for run in (a, b):
                if run.fork_s is not None:
                    axes.axvline(run.fork_s, color=INK, linewidth=1.0, linestyle=":")
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        return as_svg(figure, "Error over time in A and in B")


def _draw_events(axes: Axes, a: Run, b: Run) -> None:
    """The number of every event at its time, A above and B below; one number for a crowd."""
    end_s = max((t for run in (a, b) for t in run.frames_s), default=0.0)
    for run, y, colour in ((a, 1.0, OWN), (b, 0.0, OTHER)):
        free_from_s = 0.0
        for number, (t_ns, _text) in enumerate(run.events, start=1):
            t_s = t_ns / 1e9
            axes.plot(t_s, y - 0.45, marker="|", markersize=4, color=colour)
            if t_s >= free_from_s:
                axes.text(t_s, y, str(number), color=colour, fontsize=7, ha="center", va="center")
                free_from_s = t_s + NUMBER_WIDTH * end_s
    axes.set_ylim(-0.8, 1.6)
    axes.set_yticks([1.0, 0.0], ["A", "B"])
    axes.tick_params(left=False)
    axes.set_ylabel("events", rotation=0, ha="right", va="center", labelpad=12, fontsize=8)


def _draw_errors(
    axes: Axes, runs: tuple[Run, Run], model: ObjectModel, *, column: str, bar: float
) -> None:
    top = 3.0 * bar
    if column == "yaw_deg" and not runs[0].board.has_yaw(model.object_id):
        axes.set_yticks([])
        axes.text(0.5, 0.5, "round", ha="center", va="center", transform=axes.transAxes)
        return
    for run, colour, width in zip(runs, (OWN, OTHER), (2.4, 1.2), strict=True):
        samples = [s for s in run.board.samples(model.object_id) if s.counted]
        times = [s.t_ns / 1e9 for s in samples]
        values = np.array([getattr(s.error, column) for s in samples]).clip(SMALLEST_SHOWN)
        axes.plot(times, values, color=colour, linewidth=width, alpha=0.9)
        top = max(top, 1.3 * float(values.max(initial=0.0)))
    axes.axhline(bar, color=INK, linewidth=0.8, linestyle="--")
    axes.set_yscale("log")
    axes.set_ylim(SMALLEST_SHOWN, top)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.grid(visible=True, axis="y")
