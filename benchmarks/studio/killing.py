"""Kills the studio at random moments: how much of what was edited is offered again."""

from __future__ import annotations

import hashlib
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.studio.process import command, surroundings
from benchmarks.studio.shown import has_picture, rest, shown_window
from scenes.workers.child_process import ChildProcess
from studio.app.model.documents.autosave import Recovered, recoverable
from studio.app.model.documents.document import Document, Marker
from studio.app.model.documents.document_file import (
    SUFFIX,
    document_to_text,
    load_document,
    save_document,
)
from studio.console.rows import Row, at_most

if TYPE_CHECKING:
    from studio.app.model.workbench import Workbench

LOST_S = 2.0
"""Bar of what a kill may cost, seconds of edits."""

PROJECTS = ("first", "second")
"""Projects that are edited in turn."""

TURN, MAX_EDITS = 16, 45
"""Edits of a project before it is saved and the other one is opened, every kind and some again; and
the most before a kill: in the third turn."""

PAUSE_S = 0.03
"""Between two edits: faster than a hand."""


@dataclass(frozen=True, slots=True)
class Made:
    """An edit that was made: when (seconds since 1970), in which project, and what came of it."""

    t_s: float
    project: str
    digest: str


def kill_rows(times: int, seed: int = 0) -> list[Row]:
    """Kill a studio so often; the worst that it cost, and how often the wrong work was offered."""
    rng = np.random.default_rng(seed)
    costs = [
        _cost(int(rng.integers(1, MAX_EDITS)), float(rng.uniform(0.0, 0.3))) for _ in range(times)
    ]
    lost_s = [cost for cost in costs if cost is not None]
    return [
        at_most("studio.kill9.lost_s.max", max(lost_s, default=0.0), "s", bar=LOST_S),
        at_most("studio.kill9.wrong", len(costs) - len(lost_s), "", bar=0),
    ]


def lost_s(made: Sequence[Made], found: Sequence[Recovered], saved: Document) -> float | None:
    """Seconds of edits between what is there again and the last edit; None if it is other work.

    Args:
        made: all edits, in order.
        found: what is offered.
        saved: what the project's own file holds of the last edit's project.
    """
    last = made[-1]
    if any(item.project is None or item.project.stem != last.project for item in found):
        return None
    document = found[0].document if found else saved
    digests = [edit.digest for edit in made if edit.project == last.project]
    there = digest_of(document)
    if there not in digests:
        # Killed after it was kept, before it was told.
        is_newer = bool(found) and found[0].t_s >= last.t_s
        return 0.0 if is_newer else None
    unkept = [
        edit.t_s
        for number, edit in enumerate(made)
        if edit.project == last.project and number > _last_of(made, there)
    ]
    return last.t_s - min(unkept) if unkept else 0.0


def _last_of(made: Sequence[Made], digest: str) -> int:
    return max(number for number, edit in enumerate(made) if edit.digest == digest)


def digest_of(document: Document) -> str:
    """A short mark of all that a document holds."""
    return hashlib.sha256(document_to_text(document).encode()).hexdigest()[:16]


def _cost(edits: int, after_s: float) -> float | None:
    """Kill one studio so long after so many edits; see `lost_s`."""
    with tempfile.TemporaryDirectory(prefix="nexus-kill-") as folder:
        home = Path(folder)
        child = ChildProcess(
            command("editing", folder), stdout=subprocess.PIPE, environment=surroundings(home)
        )
        made: list[Made] = []
        is_killed = False
        for line in child.stdout:
            words = line.decode().split()
            if len(words) == 3:
                made.append(Made(float(words[0]), words[1], words[2]))
            if len(made) >= edits and not is_killed:
                is_killed = True
                time.sleep(after_s)
                child.kill()
        code = child.wait()
        if not is_killed or not made:
            raise RuntimeError(f"editing: its process ended by itself with {code}")
        saved = load_document(home / f"{made[-1].project}{SUFFIX}")
        return lost_s(made, recoverable(home), saved)


def edit_for_ever(home: Path) -> None:
    """Edit two projects in turn, telling of each edit: whoever reads it kills this process.

    Args:
        home: folder of settings, of work in progress and of the projects.
    """
    for name in PROJECTS:
        save_document(Document("lab", scenario_name=name), home / f"{name}{SUFFIX}")
    window, wait = shown_window("lab", home=home)
    bench = window.bench
    wait(lambda: window.is_filled and has_picture(window) and not window.run.is_busy)
    number = 0
    while True:
        name = PROJECTS[number // TURN % len(PROJECTS)]
        bench.perform("file.open", path=str(home / f"{name}{SUFFIX}"))
        wait(lambda name=name: bench.project is not None and bench.project.stem == name)
        wait(lambda: not window.run.is_busy)
        for _ in range(TURN):
            edit(bench, number)
            number += 1
            print(f"{time.time()} {name} {digest_of(bench.document)}", flush=True)
            rest(wait, PAUSE_S)
        bench.perform("file.save")


def edit(bench: Workbench, number: int) -> None:
    """Make the edit of a number: every kind in turn, by the actions that hands use."""
    part = 0.01 * (number % 100)
    document = bench.document
    added = [*document.twin.primitives]
    is_draft = document.draft is not None
    kinds: list[tuple[str, dict[str, Any]]] = [
        ("twin.move", {"item": "chair-1", "place": [0.5 + part, 0.5, 0.0]}),
        ("twin.turn", {"item": "chair-1", "yaw_deg": float(number % 360)}),
        ("twin.rename", {"item": "stool-1", "name": f"Stool {number}"}),
        ("twin.add_primitive", {"shape": "box", "place": [part, 0.0, 0.0]}),
        ("twin.add_avatar", {"place": [part, 1.0, 0.0]}),
        ("twin.add_camera", {"place": [part, 1.0, 2.0]}),
        ("twin.annotate", {"points": [[0.0, 0.0, 0.1], [part, 0.1, 0.1]]}),
        ("tracker.set", {"search_ms": 100 + number}),
        ("scenario.discard", {}) if is_draft else ("scenario.duration", {"s": 20.0 + number}),
        ("scenario.text", {"text": f"draft {number} ="}),
        ("scenario.discard", {}),
        ("twin.remove", {"item": added[-1]}) if added else ("edit.undo", {}),
        ("edit.undo", {}),
        ("", {}),
    ]
    action_id, values = kinds[number % len(kinds)]
    if action_id:
        bench.perform(action_id, **values)
    else:
        markers = (*document.markers, Marker(number, f"mark {number}"))
        bench.change("Mark", replace(document, markers=markers))
