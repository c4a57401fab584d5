"""The page of a comparison, with its films beside it."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

from scenes.formats.storage.atomic import write_whole
from studio.compare.comparison import Comparison, kinship, scenario_difference
from studio.compare.curves import error_curves
from studio.compare.error_map import error_maps
from studio.compare.run import Run
from studio.compare.verdicts import Compared
from studio.console.machine import describe_machine
from studio.console.spoken import Called, spoken, with_names
from studio.reports.floor_picture import floor_picture
from studio.reports.page import page

FILMS = "-films"
"""After the page's name without its ending: the folder beside it that holds copies of both films,
so that page and folder can be moved together and play without the runs."""

COPIED_BYTES = 1 << 20
"""Bytes of a film that are copied at a time."""


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
