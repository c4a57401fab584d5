"""Jitter at rest: the spread of an object's pose while the object stands still."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, performed
from benchmarks.evaluate.findings import TITLES, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.protocols.stations import carried
from scenes.opening import open_scene
from scenes.pose import Pose, wrap_angle
from scenes.samples import sample_room
from studio.console.rows import Row, at_most
from studio.evaluate.scores import SYMMETRY_OF_KIND
from tracking.model.symmetry import ROUND

SCENE, MOVED = "lab", "chair-1"
FRAME_NS = 100_000_000
ARRIVE_FRAMES, SETTLE_FRAMES, REST_FRAMES = 8, 10, 40
WAY_M, TURN_RAD = (0.35, -0.2, 0.0), math.radians(25.0)
BAR_MM, BAR_DEG = 2.0, 0.2


def evaluate(asked: Asked) -> Findings:
    """Move one chair, then let everything stand; the spread of each track about its mean."""
    room = sample_room(SCENE)
    scanned = {item.object_id: item.world_from_object for item in room.objects}
    start = scanned[MOVED]
    end = Pose.from_yaw(start.yaw() + TURN_RAD, start.translation + np.array(WAY_M))
    path = [start, start, *carried(start, end, ARRIVE_FRAMES)]
    path += [end] * (SETTLE_FRAMES + REST_FRAMES)
    taken = [Shot(k * FRAME_NS, standing({**scanned, MOVED: p})) for k, p in enumerate(path)]
    trial = Trial(open_scene(SCENE), asked.methods)
    runs: dict[str, list[list[Answer]]] = {name: [] for name in trial.methods}
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            seen: dict[str, list[Answer]] = {name: [] for name in trial.methods}
            for answers in performed(film_set, trial, taken, asked, seed=seed, what="rest"):
                for name, answer in answers.items():
                    seen[name].append(answer)
            for name, run in seen.items():
                runs[name].append(run[-REST_FRAMES:])
    kinds = {item.object_id: item.kind for item in room.objects}
    findings = Findings()
    for method, rested in runs.items():
        lines = [["object", "rms mm", "rms deg", "off by cm"]]
        worst_mm = worst_deg = 0.0
        for object_id, kind in kinds.items():
            mm, deg = jitter(rested, object_id)
            deg = 0.0 if SYMMETRY_OF_KIND.get(kind) == ROUND else deg
            worst_mm, worst_deg = max(worst_mm, mm), max(worst_deg, deg)
            off = np.mean([a.error(object_id, kind=kind).world_cm for run in rested for a in run])
            lines.append([object_id, f"{mm:.3f}", f"{deg:.3f}", f"{off:.2f}"])
            findings.rows.append(Row(row_name(method, f"rest.{object_id}.jitter_mm"), mm, "mm"))
        mm_bar, deg_bar = own_bar(method, BAR_MM), own_bar(method, BAR_DEG)
        findings.rows.append(
            at_most(row_name(method, "rest.jitter_mm"), worst_mm, "mm", bar=mm_bar)
        )
        findings.rows.append(
            at_most(row_name(method, "rest.jitter_deg"), worst_deg, "deg", bar=deg_bar)
        )
        findings.text.append(f"rest: {TITLES[method]}\n{aligned(lines)}")
    return findings


def jitter(runs: Sequence[Sequence[Answer]], object_id: str) -> tuple[float, float]:
    """Root mean square distance from the mean position (mm) and from the mean yaw (degrees)."""
    squared_m, squared_rad = [], []
    for run in runs:
        poses = [answer.tracks[object_id].world_from_object for answer in run]
        places = np.array([pose.translation for pose in poses])
        turns = np.array([wrap_angle(pose.yaw() - poses[0].yaw()) for pose in poses])
        squared_m.extend(((places - places.mean(axis=0)) ** 2).sum(axis=1))
        squared_rad.extend((turns - turns.mean()) ** 2)
    return 1000.0 * math.sqrt(np.mean(squared_m)), math.degrees(math.sqrt(np.mean(squared_rad)))
