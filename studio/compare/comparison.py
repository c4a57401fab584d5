"""Two folders become a comparison: read, held to be of one scene, and judged."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path

from scenes.package import ScenePackage
from studio.compare.run import Run, read_info, read_run
from studio.compare.verdicts import Compared, compare_rows
from studio.session.opening import scene_hash
from studio.session.records.recorded_scene import recorded_scene

CONTEXT_LINES = 1
"""Lines of a scenario that are shown around one that differs."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Two runs of one scene.

    Attributes:
        scene: that both are of.
        a: the run that is held to be good.
        b: the other.
        tolerance: share by which a figure may be worse.
        rows: all figures.
        notes: what makes the two less comparable, in words.
    """

    scene: ScenePackage
    a: Run
    b: Run
    tolerance: float
    rows: tuple[Compared, ...]
    notes: tuple[str, ...]

    @property
    def worse(self) -> tuple[Compared, ...]:
        """Figures that got worse by more than the tolerance."""
        return tuple(row for row in self.rows if row.worse)


def read_comparison(a: Path, b: Path, *, tolerance: float) -> Comparison:
    """Read both runs.

    Args:
        a: folder of the run that is held to be good.
        b: folder of the other.
        tolerance: share by which a figure may be worse.

    Raises:
        ValueError: a file is damaged, or the runs are of different scenes.
        OSError: a file cannot be read.
    """
    infos = read_info(a), read_info(b)
    if infos[0].scene_hash != infos[1].scene_hash and infos[0].scene != infos[1].scene:
        raise ValueError(
            f"{b}: of scene {infos[1].scene!r}, wanted {infos[0].scene!r} as in {a}: "
            "only runs of one scene can be compared"
        )
    scene = recorded_scene(infos[0])
    runs = [read_run(*given, scene) for given in zip("AB", (a, b), infos, strict=True)]
    rows = compare_rows(runs[0].rows, runs[1].rows, tolerance=tolerance)
    return Comparison(scene, runs[0], runs[1], tolerance, tuple(rows), _notes(scene, *runs))


def scenario_difference(a: Run, b: Run) -> list[str]:
    """Lines that differ between the two scenarios: first sign "+", "-", "@" or " "."""
    lines = difflib.unified_diff(
        a.scenario.splitlines(), b.scenario.splitlines(), n=CONTEXT_LINES, lineterm=""
    )
    return list(lines)[2:]


def kinship(a: Run, b: Run) -> str:
    """How one run comes from the other, in words; empty if it doesn't."""
    for run, other in ((b, a), (a, b)):
        fork = run.info.fork
        if fork is not None and fork.sha256 == other.recording_sha256:
            until = f"the same to the bit until {fork.t_ns / 1e9:g} s"
            return f"{run.name} is a fork of {other.name}: {until}"
    forks = a.info.fork, b.info.fork
    if forks[0] is not None and forks[1] is not None and forks[0].sha256 == forks[1].sha256:
        first_ns = min(forks[0].t_ns, forks[1].t_ns)
        return f"A and B are forks of one recording: the same until {first_ns / 1e9:g} s"
    return ""


def _notes(scene: ScenePackage, a: Run, b: Run) -> tuple[str, ...]:
    notes: list[str] = []
    if a.info.scene_hash != b.info.scene_hash:
        notes.append("The two were recorded with different versions of the scene.")
    elif scene_hash(scene) != a.info.scene_hash:
        notes.append("The scene has changed since both were recorded; the plans show the new one.")
    if a.info.methods[0] != b.info.methods[0]:
        notes.append(f"A shows the tracker {a.info.methods[0]}, B {b.info.methods[0]}.")
    if a.info.mode != b.info.mode:
        notes.append(f"A was played {a.info.mode}, B {b.info.mode}.")
    for name in sorted({*a.info.versions, *b.info.versions}):
        ours, theirs = (run.info.versions.get(name, "missing") for run in (a, b))
        if ours != theirs:
            notes.append(f"{name}: {ours} in A, {theirs} in B.")
    return tuple(notes)
