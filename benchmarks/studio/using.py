"""Hours of opening, rehearsing, forking, filming and closing in one window: what is kept of it."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.studio.process import measured
from benchmarks.studio.shown import Wait, has_picture, resident_mb, rest, shown_window
from benchmarks.studio.soaking import GROWTH_PERCENT, scenario_of
from studio.console.rows import Row, at_most

if TYPE_CHECKING:
    from studio.app.shell.main_window import MainWindow

USED_GB = 1.5
"""Bar of the window's memory, whatever was opened and closed."""

SESSION_S, FORK_S = 6.0, 3.0
"""Length of a session, and the instant at which it is forked."""

LATER = f"""
[faults]
exposure = {{ from_s = {FORK_S + 1.0}, to_s = {FORK_S + 2.0}, ev = -1.0 }}
"""
"""Something that lies after the fork: without a change there is nothing to play once more."""

LAST = 3
"""Rounds at the end whose median counts: one round alone may have been read while it was busy."""

PLAYED_S = 900.0
"""Longest that a session may take on a busy machine."""

SETTLED_S = 6.0
"""After a round, until what it has freed has been given back."""


def use_rows(minutes: float, folder: Path) -> list[Row]:
    """Use a window for so long, and hold its memory to its bars.

    Args:
        minutes: how long; it ends after the round in which they are over.
        folder: for what sessions and films leave meanwhile.
    """
    try:
        resident = measured("using", str(60 * minutes), str(folder))["resident_mb"]
    except subprocess.CalledProcessError as error:
        print(f"using: its process ended with {error.returncode}", file=sys.stderr)
        return [at_most("studio.use.crashes", 1, "", bar=0)]
    return memory_rows(resident)


def memory_rows(resident_mb: Sequence[float]) -> list[Row]:
    """Memory at the end of a use, and its growth over what the first session left, held to bars.

    Args:
        resident_mb: after the first session, and after every round.
    """
    first, *rounds = resident_mb
    last = float(np.median(rounds[-LAST:]))
    growth = 100.0 * (last / first - 1.0)
    return [
        at_most("studio.use.rss_gb", last / 1024, "GB", bar=USED_GB),
        at_most("studio.use.growth_percent", growth, "%", bar=GROWTH_PERCENT),
        Row("studio.use.rounds", len(rounds), ""),
    ]


def used(seconds: float, folder: Path) -> list[float]:
    """Memory after the first session, and after every round of use, MB.

    A round opens a project, rehearses it, looks at the recording, films it, forks it, looks at
    both, closes them and opens another room.

    Args:
        seconds: how long.
        folder: for what is made.
    """
    from studio.app.model.documents.document import Document
    from studio.app.model.documents.document_file import save_document

    end_s = time.monotonic() + seconds
    folder.mkdir(parents=True, exist_ok=True)
    project = folder / "used.nexus"
    document = Document("lab", scenario_name="used", scenario=scenario_of(SESSION_S))
    save_document(document, project)
    window, wait = shown_window(document, home=folder / "home")
    window.run.out = folder / "sessions"
    wait(lambda: window.is_filled and has_picture(window))
    _rehearse(window, wait)
    rest(wait, SETTLED_S)
    resident = [resident_mb()]
    while len(resident) == 1 or time.monotonic() < end_s:
        _round(window, wait, project)
        rest(wait, SETTLED_S)
        resident.append(resident_mb())
        print(f"{len(resident) - 1}: {resident[-1]:.0f} MB", file=sys.stderr)
    window.close()
    return resident


def _round(window: MainWindow, wait: Wait, project: Path) -> None:
    bench, run = window.bench, window.run
    timeline: Any = window.content("timeline")
    bench.perform("file.open", path=str(project))
    wait(lambda: bench.project == project)
    _rehearse(window, wait)
    rehearsal = run.report
    assert rehearsal is not None
    bench.perform("timeline.open", path=str(rehearsal))
    wait(lambda: timeline.is_open)
    for t_s in np.linspace(0.0, SESSION_S, 5)[1:-1]:
        bench.perform("timeline.seek", t_s=float(t_s))
        rest(wait, 0.5)
    _film(window, wait, project.with_name("used.mp4"))
    changed = f"{bench.document.scenario}{LATER}"
    bench.change("Darken the end", replace(bench.document, scenario=changed))
    bench.perform("timeline.fork", t_s=FORK_S)
    wait(lambda: run.report is not None and run.report != rehearsal, limit_s=PLAYED_S)
    _idle(window, wait)
    wait(lambda: timeline.is_compared)  # the window compares a fork with its original by itself
    rest(wait, 1.0)
    bench.perform("timeline.close")
    bench.perform("edit.undo")  # else the window asks what becomes of the change
    bench.perform("file.open_scene", scene="desk")
    wait(lambda: bench.document.scene == "desk")
    shutil.rmtree(rehearsal.parent)  # a long use fills no disk


def _rehearse(window: MainWindow, wait: Wait) -> None:
    window.bench.perform("session.rehearse")
    _idle(window, wait)


def _idle(window: MainWindow, wait: Wait) -> None:
    """Wait until nothing is read or played."""
    wait(lambda: not window.run.is_busy and not window.run.is_playing, limit_s=PLAYED_S)


def _film(window: MainWindow, wait: Wait, path: Path) -> None:
    from studio.app.film.view_films import ViewFilms

    path.unlink(missing_ok=True)
    films = window.findChild(ViewFilms)
    assert films is not None
    window.bench.perform("view.film", path=str(path), width=640, height=360, to_s=1.0)
    wait(lambda: not films.is_filming)
