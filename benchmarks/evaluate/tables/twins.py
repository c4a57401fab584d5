"""Identical twins that cross in front of the camera: does each track stay with its own chair?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, performed
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, own_bar, row_name
from benchmarks.evaluate.protocols.stations import WARM_UP, eased
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.samples import sample_room
from studio.console.rows import Row, at_most
from studio.evaluate.figures import OTHER, OWN
from studio.evaluate.metrics import spread

SCENE, TWINS = "lab", ("chair-1", "chair-2")
FRAME_NS = 100_000_000
CROSS_FRAMES, REST_FRAMES = 32, 6
NEAR_M, FAR_M = (0.5, 0.65), (0.0, 0.15)
"""How far from the straight line each twin goes: one nearer to the camera, one farther away."""

TURN_RAD = np.radians(60.0)
"""Most that a twin is turned on the way."""

APART_M = 0.3
"""Metres; two places nearer than this count as one."""


def evaluate(asked: Asked) -> Findings:
    """Let two chairs change places, once a seed, on ways drawn by the seed."""
    room = sample_room(SCENE)
    trial = Trial(open_scene(SCENE), asked.methods)
    runs: dict[str, list[list[Answer]]] = {name: [] for name in trial.methods}
    scanned = {item.object_id: item.world_from_object for item in room.objects}
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            taken = shots(scanned, np.random.default_rng([seed, 2]))
            answers = list(
                performed(film_set, trial, taken, asked, seed=seed, what="twins crossing")
            )
            for name in trial.methods:
                runs[name].append([answer[name] for answer in answers])
    findings = Findings()
    for method, seen in runs.items():
        findings.rows.extend(_rows(method, seen))
    findings.drawings.append(Drawing("twins", lambda figure: _draw(figure, runs)))
    return findings


def shots(scanned: Mapping[str, Pose], rng: np.random.Generator) -> tuple[Shot, ...]:
    """The twins change places, each on its own side of the line between them."""
    first, second = (scanned[name] for name in TWINS)
    along = second.translation - first.translation
    # The side towards the camera, which stands at smaller y.
    side = np.array([along[1], -along[0], 0.0]) / np.linalg.norm(along[:2])
    near = rng.uniform(*NEAR_M) * side
    far = -rng.uniform(*FAR_M) * side
    bows = (near, far) if rng.random() < 0.5 else (far, near)
    turns = rng.uniform(-TURN_RAD, TURN_RAD, 2)
    times = np.concatenate(
        [
            np.zeros(WARM_UP),
            np.linspace(0, 1, CROSS_FRAMES + 1)[1:],
            np.ones(REST_FRAMES),
        ]
    )
    taken = []
    for index, time in enumerate(times):
        share = eased(float(time))
        poses = dict(scanned)
        for name, start, way, bow, turn in zip(
            TWINS, (first, second), (along, -along), bows, turns, strict=True
        ):
            place = start.translation + share * way + np.sin(np.pi * share) * bow
            poses[name] = Pose.from_yaw(start.yaw() + share * float(turn), place)
        taken.append(Shot(index * FRAME_NS, standing(poses)))
    return tuple(taken)


def switches(run: Sequence[Answer]) -> int:
    """How often a track went over from its own chair to the other one, or back."""
    count = 0
    for name in TWINS:
        follows = name
        for answer in run:
            place = answer.tracks[name].world_from_object.translation
            distance = {
                twin: float(
                    np.linalg.norm(answer.truth.world_from_object[twin].translation - place)
                )
                for twin in TWINS
            }
            nearest = min(distance, key=distance.__getitem__)
            clearly = abs(distance[TWINS[0]] - distance[TWINS[1]]) > APART_M
            if clearly and nearest != follows:
                count += 1
                follows = nearest
    return count


def _rows(method: str, runs: Sequence[Sequence[Answer]]) -> list[Row]:
    counts = [switches(run) for run in runs]
    ended_wrong = sum(
        run[-1].error(name).world_cm > 100 * APART_M for run in runs for name in TWINS
    )
    world = spread([a.error(name).world_cm for run in runs for a in run for name in TWINS])
    final = spread([run[-1].error(name).world_cm for run in runs for name in TWINS])
    return [
        at_most(row_name(method, "twins.switches"), sum(counts), "", bar=own_bar(method, 0)),
        Row(row_name(method, "twins.crossings"), float(len(runs)), ""),
        Row(row_name(method, "twins.ended_elsewhere"), float(ended_wrong), ""),
        Row(row_name(method, "twins.world_cm.mean"), world.mean, "cm"),
        Row(row_name(method, "twins.world_cm.p95"), world.p95, "cm"),
        Row(row_name(method, "twins.final_world_cm.mean"), final.mean, "cm"),
    ]


def _draw(figure: Figure, runs: Mapping[str, Sequence[Sequence[Answer]]]) -> None:
    axes = figure.add_subplot()
    for method, colour in (("paper", OTHER), ("own", OWN)):
        for number, run in enumerate(runs.get(method, ())):
            seconds = [answer.t_ns / 1e9 for answer in run]
            for name in TWINS:
                error = [answer.error(name).world_cm for answer in run]
                label = TITLES[method] if number == 0 and name == TWINS[0] else None
                axes.plot(seconds, error, color=colour, lw=1, alpha=0.6, label=label)
    axes.set_yscale("log")
    axes.set_xlabel("time, s")
    axes.set_ylabel("world error of each twin, cm")
    axes.legend()
