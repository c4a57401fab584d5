"""Settings of a sweep of the open scenario: faults with sizes, seeds, and its folder."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.formats.storage.atomic import write_whole
from studio.app.model.runs.session_folders import NAME, local_time, reserved

if TYPE_CHECKING:  # what plays a sweep takes a second to import
    from studio.sweep.plan import Run

SWEEPS = "sweeps"
"""Folder of all sweeps, beside the sessions."""

SWEEP = "-sweep.toml"
"""Ends the name of a sweep's own file in its folder."""


@dataclass(frozen=True, slots=True)
class Offered:
    """A fault that can be swept.

    Attributes:
        name: of its line in a scenario.
        key: of its size in that line; empty where the line is the size.
        words: what people read, with the unit.
        usual: sizes to begin with.
        on_object: whether its line names an object.
    """

    name: str
    key: str
    words: str
    usual: tuple[float, ...]
    on_object: bool = False


OFFERED = (
    Offered("delay_ms", "", "Delay, ms", (150, 300)),
    Offered("jitter_ms", "", "Spread of the delay, ms", (20, 60)),
    Offered("drop_share", "", "Frames lost, share", (0.2, 0.5)),
    Offered("burst", "lasts_s", "Frames lost in a row, s", (0.5, 1)),
    Offered("blur", "px", "Blur, px", (2, 4)),
    Offered("exposure", "ev", "Exposure off by, EV", (-1, 1)),
    Offered("white_balance", "warmth", "Redder by, share", (0.3, 0.6)),
    Offered("occluder", "share", "Object covered, share", (0.3, 0.6, 0.9), on_object=True),
    Offered("clock_drift_ppm", "", "Clock drift, ppm", (100, 500)),
)
"""In the order in which they are listed."""


def sizes_of(text: str, words: str) -> tuple[float, ...]:
    """Sizes as they are typed, with commas between them, each once.

    Raises:
        ValueError: something in it is no number, or there is none.
    """
    try:
        numbers = [float(part) for part in text.replace(";", ",").split(",") if part.strip()]
    except ValueError:
        numbers = []
    if not numbers:
        raise ValueError(f"{words}: {text!r}, wanted sizes such as 150, 300")
    return tuple(dict.fromkeys(numbers))


def sweep_values(
    scenario: str, faults: Mapping[str, Sequence[float]], *, seeds: int, object_id: str
) -> dict[str, Any]:
    """The values of a sweep's file.

    Args:
        scenario: name of the scenario's file beside it.
        faults: sizes by the fault's name.
        seeds: how many runs of each size.
        object_id: of faults that concern one object.

    Raises:
        ValueError: no fault is asked for, or one needs an object and there is none.
    """
    if not faults:
        raise ValueError("a sweep needs a fault: tick one in the list")
    lines: dict[str, Any] = {}
    for each in OFFERED:
        if each.name not in faults:
            continue
        if each.on_object and not object_id:
            raise ValueError(f"{each.words}: this room has no movable object to cover")
        more = {"object": object_id} if each.on_object else {}
        sizes = [int(size) if size.is_integer() else size for size in map(float, faults[each.name])]
        lines[each.name] = {each.key: sizes, **more} if each.key else sizes
    return {"sweep": {"scenario": scenario, "seeds": list(range(seeds))}, "faults": lines}


def new_folder(root: Path, name: str) -> Path:
    """Make the folder of a sweep that begins now, beside the sessions.

    Raises:
        OSError: it cannot be made.
    """
    plain = re.sub(r"[^\w.]+", "-", name).strip("-.") or "sweep"
    return reserved(root / SWEEPS / f"{local_time().strftime(NAME)}_{plain}")


def write_sweep(folder: Path, name: str, scenario: str, values: Mapping[str, Any]) -> Path:
    """Write the scenario and the sweep of it into a folder; gives the sweep's file.

    Raises:
        OSError: the disk is full.
    """
    from studio.sweep.toml_text import toml_text

    write_whole(folder / f"{name}.toml", scenario, makes_folder=True)
    file = folder / f"{name}{SWEEP}"
    write_whole(file, toml_text(values), makes_folder=True)
    return file


def sweep_file(folder: Path) -> Path:
    """The file that a sweep's folder was made of.

    Raises:
        ValueError: there is none.
    """
    found = next(iter(sorted(folder.glob(f"*{SWEEP}"))), None)
    if found is None:
        raise ValueError(f"{folder}: holds no sweep that was begun in the studio (*{SWEEP})")
    return found


def runs_of(folder: Path, scene: str) -> dict[str, Run]:
    """All runs of a sweep by name, in the order in which they are planned.

    Raises:
        ValueError: its file is gone or damaged.
    """
    from studio.sweep.plan import load_sweep

    return {run.name: run for run in load_sweep(str(sweep_file(folder)), scene).runs}


def scene_of(folder: Path) -> str | None:
    """The room that a finished sweep was played in; None of one that was ended before."""
    from studio.sweep.results import SWEEP_JSON

    try:
        return str(json.loads((folder / SWEEP_JSON).read_text(encoding="utf-8"))["scene"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def found_rows(folder: Path) -> list[dict[str, Any]]:
    """Figures measured so far, one row a run and tracker, each with the name of its run."""
    from studio.sweep.results import RUNS

    rows: list[dict[str, Any]] = []
    for path in sorted((folder / RUNS).glob("*.json")):
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
            rows += [{**row, "run": values["run"]} for row in values["rows"]]
        except (OSError, ValueError, KeyError, TypeError):
            continue  # damaged: the sweep plays it again
    return rows


def kept_sweeps(root: Path) -> list[Path]:
    """Folders of sweeps, newest first."""
    folder = root / SWEEPS
    found = [path for path in folder.iterdir() if path.is_dir()] if folder.is_dir() else []
    return sorted((path for path in found if list(path.glob(f"*{SWEEP}"))), reverse=True)
