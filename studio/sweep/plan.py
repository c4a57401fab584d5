"""A sweep file: which scenario, which faults in which sizes, which seeds and trackers."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sim
from sim.faults.settings import LINES, NUMBERS
from sim.scenarios.scenario import load_scenario, parse_scenario
from sim.tables import ScenarioError, Table
from studio.session.trackers.methods import METHODS
from studio.sweep.toml_text import toml_text

SWEEP_FOLDER = Path(sim.__file__).parent / "sweeps"
WITHOUT = "none"
"""Name of the runs that have no fault added."""

MAX_RUNS = 10_000
"""A sweep of more would be a slip of the pen: days on any machine."""


@dataclass(frozen=True, slots=True)
class Run:
    """One rehearsal of a sweep, in plain values: any machine with the program can play it.

    Attributes:
        name: unique in the sweep; also a file name.
        scene: built-in room or path of a package, as the machine that plays it sees it.
        scenario: TOML text.
        fault: name in `[faults]`, or `WITHOUT`.
        unit: of `size`.
        size: of the fault; 0 without one.
        seed: of everything random.
        methods: trackers; all see the same pictures.
    """

    name: str
    scene: str
    scenario: str
    fault: str
    unit: str
    size: float
    seed: int
    methods: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Axis:
    """One fault of a sweep: its line in the scenario for each size."""

    fault: str
    unit: str
    lines: tuple[tuple[float, Mapping[str, Any]], ...]


@dataclass(frozen=True, slots=True)
class SweepPlan:
    """All of a sweep.

    Attributes:
        name: file name without ending.
        scenario_name: the base scenario's.
        runs: those without a fault first.
    """

    name: str
    scenario_name: str
    runs: tuple[Run, ...]


def sweep_names() -> tuple[str, ...]:
    """Names of the sweeps that come with the program."""
    return tuple(sorted(path.stem for path in SWEEP_FOLDER.glob("*.toml")))


def load_sweep(name_or_path: str, scene: str) -> SweepPlan:
    """Read a sweep by name, or a TOML file by path.

    Args:
        name_or_path: one of `sweep_names`, or a file.
        scene: where it is played.

    Raises:
        ScenarioError: there is none, it is no TOML, or a key, value or fault in it is wrong.
    """
    path = Path(name_or_path)
    if name_or_path in sweep_names():
        path = SWEEP_FOLDER / f"{name_or_path}.toml"
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or type(error).__name__
        raise ScenarioError(
            f"sweep {name_or_path!r}: cannot be read ({reason}); "
            f"wanted a TOML file or one of {', '.join(sweep_names())}"
        ) from None
    return parse_sweep(text, source=str(path), scene=scene)


def parse_sweep(text: str, *, source: str, scene: str) -> SweepPlan:
    """A sweep from TOML text.

    Args:
        text: the file's content.
        source: its name, for messages; scenarios are looked for beside it.
        scene: where it is played.

    Raises:
        ScenarioError: the text is no TOML, or a key, value or fault is wrong.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: not TOML: {error}") from None
    top = Table(values, source, "")
    settings = top.table("sweep")
    base_name, base = _base(settings, source)
    seeds = settings.integers("seeds") or (0,)
    methods = settings.texts("methods") or METHODS[:1]
    for key, given in (("seeds", seeds), ("methods", methods)):
        if len(set(given)) != len(given):
            raise settings.error(key, list(given), "each once")
    if not set(methods) <= set(METHODS):
        raise settings.error("methods", list(methods), f"some of {', '.join(METHODS)}")
    settings.done()
    top.table("faults")
    top.done()
    faults: dict[str, Any] = values.get("faults", {})
    axes = [_axis(name, value, source) for name, value in faults.items()]
    count = len(seeds) * (1 + sum(len(axis.lines) for axis in axes))
    if not axes or count > MAX_RUNS:
        raise ScenarioError(f"{source}: {count} runs, wanted faults and at most {MAX_RUNS} runs")
    runs = [
        _run(base, source, scene, axis, size, line, seed, methods)
        for axis in (Axis(WITHOUT, "", ((0.0, {}),)), *axes)
        for size, line in axis.lines
        for seed in seeds
    ]
    names = [run.name for run in runs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ScenarioError(f"{source}: run {twice!r} twice, wanted every size once")
    return SweepPlan(Path(source).stem, base_name, tuple(runs))


def _base(settings: Table, source: str) -> tuple[str, dict[str, Any]]:
    """The base scenario's name and values, with what the sweep changes of them."""
    named = settings.text("scenario")
    beside = Path(source).parent / named
    scenario = load_scenario(beside if beside.is_file() else named)
    values = tomllib.loads(Path(scenario.source).read_text(encoding="utf-8-sig"))
    duration_s = settings.optional_number("duration_s", 0.1, 3600.0)
    if duration_s is not None:
        values["duration_s"] = duration_s
    default = scenario.camera.lens_size_px
    size_px = settings.integer("lens_size_px", default, low=64, high=4096)
    if size_px != default:
        values["camera"] = {**values.get("camera", {}), "lens_size_px": size_px}
    return scenario.name, values


def _axis(name: str, value: Any, source: str) -> Axis:
    """A fault's lines: of the one key that says how large it is, one for each of a list."""
    for kind in NUMBERS:
        if name in kind.sizes:
            sizes = _sizes(value, f"{source}: faults.{name}", kind.sizes[name])
            return Axis(name, kind.sizes[name], tuple((size, {name: size}) for size in sizes))
    for kind in LINES:
        if name != kind.name:
            continue
        key, unit = next(iter(kind.sizes.items()))
        where = f"{source}: faults.{name}.{key}"
        if not isinstance(value, dict):
            raise ScenarioError(
                f"{source}: faults.{name} = {value!r}, wanted a table with {key} = a list of sizes"
            )
        sizes = _sizes(value.get(key), where, unit)
        return Axis(name, unit, tuple((size, {name: {**value, key: size}}) for size in sizes))
    known = sorted({key for kind in NUMBERS for key in kind.sizes} | {k.name for k in LINES})
    raise ScenarioError(f"{source}: faults.{name}: no such fault; wanted {', '.join(known)}")


def _sizes(value: Any, where: str, unit: str) -> tuple[Any, ...]:
    is_list = isinstance(value, list) and bool(value)
    if not is_list or any(isinstance(v, bool) or not isinstance(v, int | float) for v in value):
        raise ScenarioError(f"{where} = {value!r}, wanted a list of sizes ({unit})")
    return tuple(sorted(value))


def _run(
    base: dict[str, Any],
    source: str,
    scene: str,
    axis: Axis,
    size: float,
    line: Mapping[str, Any],
    seed: int,
    methods: tuple[str, ...],
) -> Run:
    """One run; its scenario is read once here, so that every mistake is found before the first."""
    values = copy.deepcopy(base)
    if line:
        values["faults"] = {**values.get("faults", {}), **line}
    kind = WITHOUT if axis.fault == WITHOUT else f"{axis.fault}-{size:g}"
    text = toml_text(values)
    parse_scenario(text, source=f"{source}, {kind}")
    return Run(
        f"{kind}-seed-{seed}", scene, text, axis.fault, axis.unit, float(size), seed, methods
    )
