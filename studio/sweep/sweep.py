"""A whole sweep: play what is missing, keep each run, draw the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from studio.console.progress import Progress
from studio.sweep.local import play_here
from studio.sweep.page import sweep_page
from studio.sweep.plan import Run, SweepPlan
from studio.sweep.results import SWEEP_HTML, SweepFolder

PlayAll = Callable[[Sequence[Run]], Iterator[tuple[Run, dict[str, Any]]]]
"""Plays runs somewhere and gives each with its result, in any order."""


def sweep(
    plan: SweepPlan, target: Path, *, progress: Progress, play: PlayAll = play_here
) -> list[dict[str, Any]]:
    """Play every run of a sweep that is not in the folder yet.

    Args:
        plan: the runs.
        target: folder of the results; one of an earlier, ended sweep is completed.
        progress: shows how far it is.
        play: where the runs are played.

    Returns:
        One row a run and tracker, in the order of the plan, whatever order they ended in.

    Raises:
        ValueError, OSError: an input is bad, a run cannot be played, or the disk is full; the runs
            that are whole stay.
    """
    folder = SweepFolder(target)
    results = folder.done(plan.runs)
    missing = [run for run in plan.runs if run.name not in results]
    if missing:
        _fill_caches(plan, progress)
    progress.begin(f"playing {len(missing)} of {len(plan.runs)} runs")
    for run, values in play(missing) if missing else ():
        results[run.name] = folder.add(run, values)
        progress.advance(len(results) / len(plan.runs), f"{len(results)} of {len(plan.runs)} runs")
    rows = [row for run in plan.runs for row in results[run.name]["rows"]]
    folder.finish(plan, rows, sweep_page(plan, rows))
    progress.finish(f"{target / SWEEP_HTML}")
    return rows


def _fill_caches(plan: SweepPlan, progress: Progress) -> None:
    """Open the scene once here: a built-in one is scanned on first use, which nobody does twice."""
    from scenes.opening import open_scene

    progress.begin("opening the scene (a built-in one is scanned the first time)")
    open_scene(plan.runs[0].scene)
    progress.finish()
