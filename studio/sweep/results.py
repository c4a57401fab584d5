"""The folder of a sweep: every run that is whole, so that a sweep goes on where it was ended."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from scenes.formats.storage.atomic import name_when_whole, write_whole
from studio.console.machine import program_version
from studio.sweep.plan import Run, SweepPlan

RUNS, SWEEP_JSON, SWEEP_HTML = "runs", "sweep.json", "sweep.html"
OWN_NAMES = frozenset({RUNS, SWEEP_JSON, SWEEP_HTML})


class SweepFolder:
    """Folder of a sweep's results, run by run.

    Args:
        folder: made if it is not there.

    Raises:
        ValueError: it is a file, or holds files that no sweep wrote.
        OSError: it cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        if folder.exists() and not folder.is_dir():
            raise ValueError(f"{folder}: is a file; choose another folder with --out")
        names = sorted(e.name for e in folder.iterdir()) if folder.exists() else []
        foreign = [name for name in names if not _is_own(name_when_whole(name))]
        if foreign:
            raise ValueError(
                f"{folder}: holds {foreign[0]!r}, which no sweep wrote; "
                "choose an empty folder or an earlier sweep with --out"
            )
        (folder / RUNS).mkdir(parents=True, exist_ok=True)
        self._folder = folder

    def done(self, runs: Iterable[Run]) -> dict[str, dict[str, Any]]:
        """Return the results that are there, by run; a run that was made otherwise has none."""
        found: dict[str, dict[str, Any]] = {}
        for run in runs:
            try:
                values = json.loads(self._path(run).read_text(encoding="utf-8"))
            except (OSError, ValueError):
                continue
            if isinstance(values, dict) and values.get("run_hash") == run_hash(run):
                found[run.name] = values
        return found

    def add(self, run: Run, values: Mapping[str, Any]) -> dict[str, Any]:
        """Keep what a run gave."""
        whole = {"run": run.name, "run_hash": run_hash(run), **values}
        write_whole(self._path(run), json.dumps(whole, indent=1, allow_nan=False) + "\n")
        return whole

    def finish(self, plan: SweepPlan, rows: Sequence[Mapping[str, Any]], page: str) -> None:
        """Write the whole sweep's rows and its page."""
        values = {
            "format": "gaussiannexus sweep",
            "version": 1,
            "sweep": plan.name,
            "scene": plan.runs[0].scene,
            "scenario": plan.scenario_name,
            "program": program_version(),
            "rows": list(rows),
        }
        write_whole(self._folder / SWEEP_JSON, json.dumps(values, indent=1, allow_nan=False) + "\n")
        write_whole(self._folder / SWEEP_HTML, page)

    def _path(self, run: Run) -> Path:
        return self._folder / RUNS / f"{run.name}.json"


def _is_own(name: str) -> bool:
    """Whether a sweep wrote it, or it is what the sweep was made of: its file, a scenario."""
    return name in OWN_NAMES or name.endswith(".toml")


def run_hash(run: Run) -> str:
    """A digest of everything that decides what a run gives."""
    text = json.dumps([asdict(run), program_version()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
