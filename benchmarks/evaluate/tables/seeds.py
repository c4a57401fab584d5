"""The default rehearsal over seeds: how exact it is in most of them, and in the worst."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.findings import TITLES, Findings, aligned, own_bar, row_name
from studio.console.rows import Row, at_most
from studio.evaluate.perfect_detector import PerfectDetector
from studio.evaluate.scores import ScoreBoard
from studio.session.opening import open_session
from studio.session.plan import SessionPlan
from studio.session.session import SessionOutput

SCENE = "lab"

BARS_CM: Mapping[str, tuple[float, float]] = {"chairs": (0.5, 1.0), "objects": (1.0, 2.0)}
"""Mean error of a seed in cm, by what it is over: median over the seeds, and the worst."""

AT_REST_BAR_CM = 3.0
"""Largest error in cm of an object that nobody moves."""


@dataclass(frozen=True, slots=True)
class Played:
    """One seed's rehearsal by one method.

    Attributes:
        seed: of it.
        chairs_cm: mean position error of the chairs that moved.
        objects_cm: the same of all objects that moved.
        at_rest_cm: largest error of those that never moved.
    """

    seed: int
    chairs_cm: float
    objects_cm: float
    at_rest_cm: float


def evaluate(asked: Asked) -> Findings:
    """Play the default rehearsal once a seed; its own camera is used, whatever the conditions."""
    runs: dict[str, list[Played]] = {name: [] for name in asked.methods}
    steps_ms: list[float] = []
    for seed in asked.seeds:
        asked.progress.begin(f"rehearsing seed {seed}")
        boards, durations_ms = _rehearsed(asked, seed)
        steps_ms += durations_ms
        for name, board in boards.items():
            runs[name].append(_played(seed, board))
        asked.progress.finish()
    findings = Findings()
    for method, played in runs.items():
        findings.rows.extend(_rows(method, played))
        findings.text.append(_table(method, played))
    if "own" in runs and steps_ms:
        findings.rows.append(
            Row("rehearse.seeds.step_ms.p95", float(np.percentile(steps_ms, 95)), "ms")
        )
    return findings


def _rehearsed(asked: Asked, seed: int) -> tuple[dict[str, ScoreBoard], list[float]]:
    """Scores by method, and how long our tracker took for each frame but the first, in ms."""
    detector = PerfectDetector() if "paper" in asked.methods else None
    plan = SessionPlan(scene=SCENE, seed=seed, methods=asked.methods)
    session = open_session(plan, truth_detector=detector)
    boards = {name: ScoreBoard(session.scene.objects) for name in asked.methods}
    durations_ms: list[float] = []

    def watch(output: SessionOutput) -> None:
        truth = output.message.truth
        assert truth is not None
        for name, answer in output.tracks.items():
            boards[name].add(answer.objects, truth.recorded)
        if "own" in output.tracks:
            durations_ms.append(sum(output.tracks["own"].stage_ns.values()) / 1e6)
        asked.progress.advance(output.message.frame.t_ns / session.duration_ns)

    session.run(watch)
    return boards, durations_ms[1:]


def _played(seed: int, board: ScoreBoard) -> Played:
    chairs, objects = board.score(kind="chair"), board.score()
    assert chairs is not None
    assert objects is not None
    moved = {model.object_id for model in board.moved()}
    at_rest = [
        sample.error.world_cm
        for object_id in board.object_ids()
        if object_id not in moved
        for sample in board.samples(object_id)
    ]
    return Played(seed, chairs.world_cm.mean, objects.world_cm.mean, max(at_rest, default=0.0))


def _rows(method: str, played: Sequence[Played]) -> list[Row]:
    rows: list[Row] = []
    for of, (median_bar, worst_bar) in BARS_CM.items():
        errors = [getattr(run, f"{of}_cm") for run in played]
        for name, value, bar in (
            ("median", float(np.median(errors)), median_bar),
            ("max", max(errors), worst_bar),
        ):
            row = row_name(method, f"rehearse.seeds.{of}_cm.{name}")
            rows.append(at_most(row, value, "cm", bar=own_bar(method, bar)))
    at_rest = max(run.at_rest_cm for run in played)
    name = row_name(method, "rehearse.seeds.at_rest_cm.max")
    rows.append(at_most(name, at_rest, "cm", bar=own_bar(method, AT_REST_BAR_CM)))
    return rows


def _table(method: str, played: Sequence[Played]) -> str:
    lines = [["seed", "chairs cm", "objects cm", "at rest cm"]]
    lines += [
        [
            str(run.seed),
            f"{run.chairs_cm:.2f}",
            f"{run.objects_cm:.2f}",
            f"{run.at_rest_cm:.2f}",
        ]
        for run in played
    ]
    return f"default rehearsal by seed: {TITLES[method]} (means; at rest the largest)\n" + aligned(
        lines
    )
