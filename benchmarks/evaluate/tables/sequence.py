"""Continuous motion: a chair pushed through the room, a book moved by hand, 1 to 4 frames a step.

Frame steps leave pictures out, so that the same way is seen in larger jumps (as in published
benchmarks of region trackers). There is no help after a failure: a tracker has to find the object
again by itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, film_messages, performed
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, own_bar, row_name
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.samples import sample_room
from sim.bodies import Placement
from studio.console.rows import Row, at_least, at_most
from studio.evaluate.figures import OTHER, OWN
from studio.evaluate.metrics import spread
from studio.session.pipeline import SessionMessage

FRAME_NS = 33_333_333
FRAMES = 100
STEPS = (1, 2, 3, 4)
GOOD_CM, GOOD_DEG = 5.0, 5.0
PUSHED_BAR_CM = 1.5

DRIFT_S, DRIFT_FRAME_NS = 60, 400_000_000
"""A minute of slow motion, two and a half pictures a second."""


@dataclass(frozen=True, slots=True)
class Motion:
    """An object's way: a closed curve of sines about a point.

    Attributes:
        scene: built-in room.
        object_id: what moves.
        kind: of that object.
        centre_m: (x, y, z) the way is around.
        reach_m: how far it goes from there, along x, y and z.
        turn_rad: how far it is turned either way.
        period_s: of the slowest sine.
    """

    scene: str
    object_id: str
    kind: str
    centre_m: tuple[float, float, float]
    reach_m: tuple[float, float, float]
    turn_rad: float
    period_s: float


PUSHED = Motion("lab", "chair-1", "chair", (-0.95, 1.1, 0.0), (0.55, 0.35, 0.0), 0.9, 5.0)
HAND_HELD = Motion("desk", "book-1", "book", (-0.25, 0.26, 0.86), (0.16, 0.14, 0.08), 0.8, 4.0)


def evaluate(asked: Asked) -> Findings:
    """Share of good frames by frame step, errors of the pushed chair, drift over a minute."""
    findings = Findings()
    curves: dict[str, dict[str, list[float]]] = {}
    for motion in (PUSHED, HAND_HELD):
        name = "chair" if motion is PUSHED else "book"
        by_step = _stepped(motion, asked)
        for method, runs in by_step.items():
            findings.rows.extend(_step_rows(method, name, motion, runs))
            shares = [good_share(runs[step], motion) for step in STEPS]
            curves.setdefault(method, {})[name] = shares
    for method, run in _minute(asked).items():
        findings.rows.extend(_drift_rows(method, run))
    findings.text.extend(_table(method, shares) for method, shares in curves.items())
    findings.drawings.append(Drawing("sequence", lambda figure: _draw(figure, curves)))
    return findings


def way(
    motion: Motion, world_from_start: Pose, seconds: Iterable[float], rng: np.random.Generator
) -> list[Pose]:
    """Poses along the motion, which leaves its start gently."""
    amplitude = rng.uniform(0.4, 1.0, (4, 2))
    amplitude /= amplitude.sum(axis=1, keepdims=True)
    phase = rng.uniform(0, 2 * math.pi, (4, 2))
    reach = np.array([*motion.reach_m, motion.turn_rad])
    middle = np.array([*motion.centre_m, world_from_start.yaw()])
    begin = np.array([*world_from_start.translation, world_from_start.yaw()])
    poses = []
    for t in seconds:
        angle = 2 * math.pi * t / motion.period_s * np.array([1.0, 2.0]) + phase
        wanted = middle + reach * (amplitude * np.sin(angle)).sum(axis=1)
        ease = min(t / 1.2, 1.0)
        ease = ease * ease * (3 - 2 * ease)
        value = begin + ease * (wanted - begin)
        poses.append(Pose.from_yaw(float(value[3]), value[:3]))
    return poses


def good_share(runs: Sequence[Sequence[Answer]], motion: Motion) -> float:
    """Share of frames within 5 cm and 5°."""
    errors = [a.error(motion.object_id, kind=motion.kind) for run in runs for a in run]
    return float(np.mean([e.world_cm <= GOOD_CM and e.yaw_deg <= GOOD_DEG for e in errors]))


def _stepped(motion: Motion, asked: Asked) -> Mapping[str, Mapping[int, list[list[Answer]]]]:
    """Return every method's answers at every frame step, one list a seed."""
    room = sample_room(motion.scene)
    trial = Trial(open_scene(motion.scene), asked.methods)
    found: dict[str, dict[int, list[list[Answer]]]] = {
        name: {step: [] for step in STEPS} for name in trial.methods
    }
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            taken = _shots(film_set, motion, FRAMES, FRAME_NS, seed)
            what = f"{motion.object_id} in motion"
            for step in STEPS:
                messages = film_messages(film_set, taken, asked, seed=seed, what=what)
                seen: dict[str, list[Answer]] = {name: [] for name in trial.methods}
                asked.progress.begin(f"tracking {what}, every {step}. frame, seed {seed}")
                for answers in trial.run(every(messages, step)):
                    for name, answer in answers.items():
                        seen[name].append(answer)
                    asked.progress.advance(answer_share(seen, len(taken) // step))
                asked.progress.finish()
                for name, run in seen.items():
                    found[name][step].append(run)
    return found


def every(messages: Iterable[SessionMessage], step: int) -> Iterable[SessionMessage]:
    """Every `step`-th frame, as if that were the camera's pace: time is squeezed accordingly."""
    for index, message in enumerate(messages):
        if index % step == 0:
            t_ns = message.frame.t_ns // step
            frame = replace(message.frame, t_ns=t_ns, received_ns=t_ns, seq=index // step)
            yield message.with_frame(frame)


def answer_share(seen: Mapping[str, Sequence[Answer]], wanted: int) -> float:
    """How much of a run is done."""
    return min(len(run) for run in seen.values()) / max(wanted, 1)


def _minute(asked: Asked) -> Mapping[str, list[Answer]]:
    """A minute of slow motion of the chair, by the first seed."""
    motion = replace(PUSHED, period_s=30.0)
    room = sample_room(motion.scene)
    trial = Trial(open_scene(motion.scene), asked.methods)
    count = round(DRIFT_S * 1e9 / DRIFT_FRAME_NS)
    found: dict[str, list[Answer]] = {name: [] for name in trial.methods}
    with FilmSet(room, cache=asked.cache) as film_set:
        seed = asked.seeds[0]
        taken = _shots(film_set, motion, count, DRIFT_FRAME_NS, seed)
        for answers in performed(
            film_set, trial, taken, asked, seed=seed, what="a minute of motion"
        ):
            for name, answer in answers.items():
                found[name].append(answer)
    return found


def _shots(film_set: FilmSet, motion: Motion, count: int, spacing_ns: int, seed: int) -> list[Shot]:
    poses = {item.object_id: item.world_from_object for item in film_set.room.objects}
    rng = np.random.default_rng([seed, 30])
    seconds = [index * spacing_ns / 1e9 for index in range(count)]
    support_z_m = float(poses[motion.object_id].translation[2])
    return [
        Shot(
            index * spacing_ns,
            {**standing(poses), motion.object_id: Placement((pose,), support_z_m)},
        )
        for index, pose in enumerate(way(motion, poses[motion.object_id], seconds, rng))
    ]


def _step_rows(
    method: str, name: str, motion: Motion, runs: Mapping[int, Sequence[Sequence[Answer]]]
) -> list[Row]:
    rows = [
        at_least(
            row_name(method, f"sequence.{name}.step{step}.5cm5deg"),
            good_share(runs[step], motion),
            "",
        )
        for step in STEPS
    ]
    errors = [a.error(motion.object_id, kind=motion.kind) for run in runs[1] for a in run]
    world = spread([error.world_cm for error in errors])
    bar = own_bar(method, PUSHED_BAR_CM if motion is PUSHED else None)
    rows.append(
        at_most(row_name(method, f"sequence.{name}.world_cm.mean"), world.mean, "cm", bar=bar)
    )
    rows.append(Row(row_name(method, f"sequence.{name}.world_cm.p95"), world.p95, "cm"))
    yaw = spread([error.yaw_deg for error in errors])
    rows.append(Row(row_name(method, f"sequence.{name}.yaw_deg.mean"), yaw.mean, "deg"))
    return rows


def _drift_rows(method: str, run: Sequence[Answer]) -> list[Row]:
    """Mean errors in the first and the last ten seconds, and the difference."""
    errors = [answer.error(PUSHED.object_id, kind=PUSHED.kind).world_cm for answer in run]
    part = max(1, len(errors) // 6)
    first, last = float(np.mean(errors[:part])), float(np.mean(errors[-part:]))
    return [
        Row(row_name(method, "sequence.drift.first_10s_cm"), first, "cm"),
        Row(row_name(method, "sequence.drift.last_10s_cm"), last, "cm"),
        Row(row_name(method, "sequence.drift_60s_cm"), last - first, "cm"),
    ]


def _table(method: str, shares: Mapping[str, Sequence[float]]) -> str:
    lines = [["frame step", *(str(step) for step in STEPS)]]
    lines += [[name, *(f"{share:.0%}" for share in values)] for name, values in shares.items()]
    return f"within 5 cm and 5°: {TITLES[method]}\n{aligned(lines)}"


def _draw(figure: Figure, curves: Mapping[str, Mapping[str, Sequence[float]]]) -> None:
    axes = figure.add_subplot()
    for method, shares in curves.items():
        for name, values in shares.items():
            style = "o-" if name == "chair" else "s--"
            colour = OWN if method == "own" else OTHER
            label = f"{name}, {TITLES[method]}"
            axes.plot(STEPS, [100 * v for v in values], style, color=colour, label=label)
    axes.set_xticks(STEPS)
    axes.set_ylim(0, 103)
    axes.set_xlabel("frame step")
    axes.set_ylabel("frames within 5 cm and 5°, %")
    axes.legend()
