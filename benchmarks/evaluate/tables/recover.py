"""Ten objects that were moved between sessions: how many are found again by themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import linear_sum_assignment

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, last_of, performed
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.protocols.ten_objects import shuffled, ten_objects
from scenes.mesh import PhysicalRoom
from studio.console.rows import Row, at_least
from studio.evaluate.figures import OTHER, OWN
from studio.evaluate.metrics import pose_error
from studio.evaluate.scores import SYMMETRY_OF_KIND

SECOND_NS = 1_000_000_000
SECONDS = 20
"""How long a tracker may look, one picture a second."""

RIGHT_CM, RIGHT_DEG = 5.0, 5.0

RIGHT_BAR = 9.0


@dataclass(frozen=True, slots=True)
class Found:
    """One object after the search.

    Attributes:
        object_id: which.
        world_cm: how far its pose is off, from its own place or that of an identical twin.
        yaw_deg: likewise.
        right: whether both are small.
        flagged: whether the tracker says that it may be wrong.
        own_place: whether it is right and not a twin's.
    """

    object_id: str
    world_cm: float
    yaw_deg: float
    right: bool
    flagged: bool
    own_place: bool


def evaluate(asked: Asked, seconds: int = SECONDS) -> Findings:
    """Shuffle ten objects, once a seed, and start a session on a scan that knows the old places."""
    room, scene = ten_objects()
    trial = Trial(scene, asked.methods)
    ends: dict[str, list[list[Found]]] = {name: [] for name in trial.methods}
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            poses = standing(shuffled(room, np.random.default_rng([seed, 10])))
            taken = [Shot(k * SECOND_NS, poses) for k in range(seconds)]
            answers = performed(film_set, trial, taken, asked, seed=seed, what="ten objects")
            for name, answer in last_of(answers).items():
                ends[name].append(judged(room, answer))
    findings = Findings()
    for method, runs in ends.items():
        findings.rows.extend(_rows(method, runs))
        findings.text.append(_table(method, runs))
    findings.drawings.append(Drawing("recover", lambda figure: _draw(figure, ends, seconds)))
    return findings


def judged(room: PhysicalRoom, answer: Answer) -> list[Found]:
    """Every object against the places of its kind; each place counts for one object only."""
    found: list[Found] = []
    for kind in dict.fromkeys(item.kind for item in room.objects):
        ids = [item.object_id for item in room.objects if item.kind == kind]
        errors = [
            [
                pose_error(
                    answer.tracks[track].world_from_object,
                    answer.truth.world_from_object[place],
                    symmetry=SYMMETRY_OF_KIND.get(kind, 1),
                )
                for place in ids
            ]
            for track in ids
        ]
        cost = [[min(error.world_cm, 200.0) for error in row] for row in errors]
        for i, j in zip(*linear_sum_assignment(np.array(cost)), strict=True):
            error = errors[i][j]
            right = error.world_cm <= RIGHT_CM and error.yaw_deg <= RIGHT_DEG
            track = answer.tracks[ids[i]]
            found.append(
                Found(
                    ids[i],
                    error.world_cm,
                    error.yaw_deg,
                    right,
                    track.is_flagged,
                    right and bool(i == j),
                )
            )
    return found


def _rows(method: str, runs: Sequence[Sequence[Found]]) -> list[Row]:
    right = [sum(found.right for found in run) for run in runs]
    own_place = [sum(found.own_place for found in run) for run in runs]
    wrong = [found for run in runs for found in run if not found.right]
    flagged = float(np.mean([found.flagged for found in wrong])) if wrong else 1.0
    false_alarms = sum(found.flagged for run in runs for found in run if found.right)
    return [
        at_least(
            row_name(method, "recover.right"),
            float(np.mean(right)),
            "",
            bar=own_bar(method, RIGHT_BAR),
        ),
        Row(row_name(method, "recover.right.min"), float(min(right)), ""),
        Row(row_name(method, "recover.at_own_place"), float(np.mean(own_place)), ""),
        at_least(row_name(method, "recover.wrong_flagged"), flagged, "", bar=own_bar(method, 1.0)),
        Row(row_name(method, "recover.right_but_flagged"), float(false_alarms), ""),
    ]


def _table(method: str, runs: Sequence[Sequence[Found]]) -> str:
    lines = [["object", "right", "world cm", "yaw deg", "wrong, flagged"]]
    for object_id in [found.object_id for found in runs[0]]:
        seen = [next(f for f in run if f.object_id == object_id) for run in runs]
        wrong = [found for found in seen if not found.right]
        lines.append(
            [
                object_id,
                f"{sum(found.right for found in seen)} of {len(seen)}",
                f"{np.median([found.world_cm for found in seen]):.2f}",
                f"{np.median([found.yaw_deg for found in seen]):.2f}",
                f"{sum(found.flagged for found in wrong)} of {len(wrong)}",
            ]
        )
    return f"recover: {TITLES[method]} (medians over the seeds)\n{aligned(lines)}"


def _draw(figure: Figure, ends: Mapping[str, Sequence[Sequence[Found]]], seconds: int) -> None:
    axes = figure.add_subplot()
    for method, colour, shift in (("own", OWN, -0.12), ("paper", OTHER, 0.12)):
        for number, run in enumerate(ends.get(method, ())):
            place = np.arange(len(run)) + shift
            label = TITLES[method] if number == 0 else None
            error = [max(found.world_cm, 0.05) for found in run]
            axes.plot(place, error, "o", color=colour, alpha=0.7, label=label)
            axes.set_xticks(np.arange(len(run)), [found.object_id for found in run], rotation=40)
    axes.axhline(RIGHT_CM, color="0.5", lw=1, ls="--")
    axes.set_yscale("log")
    axes.set_ylabel(f"world error after {seconds} s, cm")
    axes.legend()
