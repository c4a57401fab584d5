"""How a tracker bears it when something hides a share of the object, or all of it for a while."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, film_messages
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.protocols.screen import SCREEN_ID, hiding, screen_body
from benchmarks.evaluate.protocols.stations import WARM_UP, carried
from scenes.mesh import PhysicalRoom
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.samples import sample_room
from sim.bodies import Placement
from studio.console.rows import Row, at_most
from studio.evaluate.figures import OTHER, OWN
from studio.session.pipeline import SessionMessage

SCENE, OBJECT, KIND, TWIN = "lab", "chair-1", "chair", "chair-2"
SHARES = tuple(k / 10 for k in range(10))
FRAME_NS = 100_000_000
MOVE_FRAMES, REST_FRAMES = 9, 3
WAY_M, TURN_RAD = (0.45, 0.25), np.radians(40.0)
"""How far the chair is pushed and turned while a share of it is hidden."""

COVER_FRAMES, HIDDEN_FRAMES, AFTER_FRAMES = 3, 20, 12
HIDDEN_WAY_M, HIDDEN_TURN_RAD = (0.25, 0.15), np.radians(20.0)
"""How far it is moved while nothing of it is seen."""

FOUND_CM, FOUND_DEG = 5.0, 5.0
"""An object is found again when it is as near as this, and stays so."""

SEEN_AGAIN = 0.5
"""Visible fraction from which the time until it is found again counts."""

RATIO_BAR, REFOUND_BAR_S = 2.0, 0.5


@dataclass(frozen=True, slots=True)
class Passage:
    """A part of the take that begins where the warm-up ended.

    Attributes:
        name: what happens.
        begin: number of its first picture.
        end: number after its last.
    """

    name: str
    begin: int
    end: int


def evaluate(asked: Asked, shares: Sequence[float] = SHARES) -> Findings:
    """Error against the hidden share, and the time to find what was hidden altogether."""
    room = sample_room(SCENE)
    taken, passages = shots(room, shares)
    trial = Trial(open_scene(SCENE), asked.methods)
    answers: dict[str, dict[str, list[list[Answer]]]] = {
        name: {passage.name: [] for passage in passages} for name in trial.methods
    }
    with FilmSet(room, (screen_body(),), cache=asked.cache) as film_set:
        for seed in asked.seeds:
            messages = film_messages(film_set, taken, asked, seed=seed, what="what is hidden")
            asked.progress.begin(f"tracking what is hidden, seed {seed}")
            for method, passage, run in _played(trial, messages, passages, asked):
                answers[method][passage].append(run)
            asked.progress.finish()
    return _report(answers, shares)


def shots(
    room: PhysicalRoom, shares: Sequence[float] = SHARES
) -> tuple[tuple[Shot, ...], tuple[Passage, ...]]:
    """The pictures: as scanned, then a passage for each hidden share, then two of total hiding."""
    item = room.object_by_id(OBJECT)
    eye = room.world_from_rig.translation
    others = {item.object_id: item.world_from_object for item in room.objects}
    start = item.world_from_object
    frames: list[tuple[Pose, Placement | None]] = [(start, None)] * WARM_UP
    passages: list[Passage] = []

    def passage(name: str, part: Sequence[tuple[Pose, float, Pose]]) -> None:
        begin = len(frames)
        frames.extend((pose, hiding(eye, item, about, share)) for pose, share, about in part)
        passages.append(Passage(name, begin, len(frames)))

    way = carried(start, _moved(start, WAY_M, TURN_RAD), MOVE_FRAMES)
    way += [way[-1]] * REST_FRAMES
    for share in shares:
        passage(f"{share:.0%}", [(pose, share, pose) for pose in way])
    hidden_way = carried(start, _moved(start, HIDDEN_WAY_M, HIDDEN_TURN_RAD), HIDDEN_FRAMES)
    for name, hidden in (("still", [start] * HIDDEN_FRAMES), ("moved", hidden_way)):
        cover = np.linspace(0, 1, COVER_FRAMES + 2)[1:-1]
        end = hidden[-1]
        passage(
            name,
            [
                *((start, float(share), start) for share in cover),
                *((pose, 1.0, pose) for pose in hidden),
                *((end, float(share), end) for share in cover[::-1]),
                *((end, 0.0, end) for _ in range(AFTER_FRAMES)),
            ],
        )
    taken = tuple(
        Shot(
            index * FRAME_NS,
            {
                **standing({**others, OBJECT: pose}),
                **({SCREEN_ID: screen} if screen is not None else {}),
            },
        )
        for index, (pose, screen) in enumerate(frames)
    )
    return taken, tuple(passages)


def _moved(pose: Pose, way_m: tuple[float, float], turn_rad: float) -> Pose:
    return Pose.from_yaw(pose.yaw() + turn_rad, pose.translation + np.array([*way_m, 0.0]))


def _played(
    trial: Trial, messages: Iterator[SessionMessage], passages: Sequence[Passage], asked: Asked
) -> Iterator[tuple[str, str, list[Answer]]]:
    """Every passage begins in the state after the warm-up, at the time after it."""
    states = trial.start()
    for _ in range(WARM_UP):
        states, _answers = trial.step(states, next(messages))
    warm = states
    for passage in passages:
        states = warm
        seen: dict[str, list[Answer]] = {name: [] for name in trial.methods}
        for index in range(passage.begin, passage.end):
            message = _at(next(messages), WARM_UP + index - passage.begin)
            states, answers = trial.step(states, message)
            for name, answer in answers.items():
                seen[name].append(answer)
            asked.progress.advance(index / passages[-1].end, passage.name)
        for name, run in seen.items():
            yield name, passage.name, run


def _at(message: SessionMessage, index: int) -> SessionMessage:
    """The same picture as if it had been taken earlier."""
    t_ns = index * FRAME_NS
    return message.with_frame(replace(message.frame, t_ns=t_ns, received_ns=t_ns, seq=index))


def _report(
    answers: Mapping[str, Mapping[str, Sequence[Sequence[Answer]]]], shares: Sequence[float]
) -> Findings:
    findings = Findings()
    curves: dict[str, list[tuple[float, float, float]]] = {}
    for method, by_passage in answers.items():
        curve = curves.setdefault(method, [])
        for share in shares:
            seen = [a for run in by_passage[f"{share:.0%}"] for a in run]
            errors = [a.error(OBJECT, kind=KIND) for a in seen]
            hidden = 1.0 - float(np.mean([a.truth.visible_fraction[OBJECT] for a in seen]))
            world, yaw = (float(np.mean([getattr(e, c) for e in errors])) for c in _MEANS)
            curve.append((hidden, world, yaw))
            base = f"occlusion.{100 * share:.0f}"
            findings.rows.append(Row(row_name(method, f"{base}.world_cm.mean"), world, "cm"))
            findings.rows.append(Row(row_name(method, f"{base}.yaw_deg.mean"), yaw, "deg"))
        if {0.0, 0.5} <= set(shares):
            half, none = (curve[shares.index(share)] for share in (0.5, 0.0))
            findings.rows.append(
                at_most(
                    row_name(method, "occlusion.50.error_ratio"),
                    half[1] / max(none[1], 1e-6),
                    "",
                    bar=own_bar(method, RATIO_BAR),
                )
            )
        times = {name: [refound_s(run) for run in by_passage[name]] for name in ("still", "moved")}
        for name, values in times.items():
            findings.rows.append(
                Row(row_name(method, f"occlusion.refound_{name}_s"), max(values), "s")
            )
        worst = max(max(values) for values in times.values())
        findings.rows.append(
            at_most(
                row_name(method, "occlusion.refound_s"),
                worst,
                "s",
                bar=own_bar(method, REFOUND_BAR_S),
            )
        )
        switched = sum(is_switched(run[-1]) for name in times for run in by_passage[name])
        findings.rows.append(
            at_most(row_name(method, "occlusion.switches"), switched, "", bar=own_bar(method, 0))
        )
        findings.text.append(_table(method, shares, curve))
    findings.drawings.append(Drawing("occlusion", lambda figure: _draw(figure, curves)))
    return findings


_MEANS = ("world_cm", "yaw_deg")


def refound_s(run: Sequence[Answer]) -> float:
    """Seconds from being seen again until the pose is right and stays so; infinite if never."""
    visible = [answer.truth.visible_fraction[OBJECT] for answer in run]
    hidden = [index for index, share in enumerate(visible) if share < SEEN_AGAIN]
    again = hidden[-1] + 1 if hidden else 0
    errors = [answer.error(OBJECT, kind=KIND) for answer in run]
    wrong = [
        index
        for index, error in enumerate(errors)
        if error.world_cm > FOUND_CM or error.yaw_deg > FOUND_DEG
    ]
    found = max(again, wrong[-1] + 1 if wrong else 0)
    if found >= len(run):
        return float("inf")
    return (run[found].t_ns - run[again].t_ns) / 1e9


def is_switched(answer: Answer) -> bool:
    """Whether the object's track lies nearer to its twin than to itself."""
    place = answer.tracks[OBJECT].world_from_object.translation
    own, twin = (answer.truth.world_from_object[name].translation for name in (OBJECT, TWIN))
    return float(np.linalg.norm(place - twin)) < float(np.linalg.norm(place - own))


def _table(
    method: str, shares: Sequence[float], curve: Sequence[tuple[float, float, float]]
) -> str:
    lines = [["asked to hide", "hidden", "world cm", "yaw deg", "world / unhidden"]]
    for share, (hidden, world, yaw) in zip(shares, curve, strict=True):
        ratio = world / max(curve[0][1], 1e-6)
        lines.append(
            [f"{share:.0%}", f"{hidden:.0%}", f"{world:.2f}", f"{yaw:.2f}", f"{ratio:.2f}"]
        )
    return f"occlusion: {TITLES[method]}\n{aligned(lines)}"


def _draw(figure: Figure, curves: Mapping[str, Sequence[tuple[float, float, float]]]) -> None:
    axes = figure.add_subplot()
    for method, curve in curves.items():
        hidden, world, _ = np.array(curve).T
        colour = OWN if method == "own" else OTHER
        axes.plot(100 * hidden, world, "o-", color=colour, label=TITLES[method])
    axes.set_yscale("log")
    axes.set_xlabel("hidden, % of the chair's picture")
    axes.set_ylabel("mean world error while pushed, cm")
    axes.legend()
