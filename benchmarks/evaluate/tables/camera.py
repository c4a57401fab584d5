"""Error of the camera's pose that self-calibration leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Trial, last_of, performed
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.tables.camera_alone import calibrated, located
from scenes.opening import open_scene
from scenes.samples import sample_room
from studio.console.rows import Row, at_most
from studio.evaluate.figures import OTHER, OWN
from studio.evaluate.metrics import spread

SCENES = ("lab", "desk")
FRAMES = 2
FRAME_NS = 100_000_000
FACTORS = (1.0, 2.0, 4.0)
"""Times the asked-for pose error; the figures with bars are those of the first."""

BAR_DEG, BAR_MM = 0.1, 5.0

Left = tuple[float, float]


def evaluate(asked: Asked) -> Findings:
    """Start a session, once a seed and room, with the camera's pose wrong in a random direction."""
    left: dict[str, dict[tuple[str, float], list[Left]]] = {name: {} for name in asked.methods}
    for scene in SCENES:
        room = sample_room(scene)
        trial = Trial(open_scene(scene), asked.methods)
        poses = standing({item.object_id: item.world_from_object for item in room.objects})
        taken = [Shot(k * FRAME_NS, poses) for k in range(FRAMES)]
        with FilmSet(room, cache=asked.cache) as film_set:
            for factor in FACTORS:
                wrong = replace(
                    asked.conditions,
                    pose_error_deg=factor * asked.conditions.pose_error_deg,
                    pose_error_cm=factor * asked.conditions.pose_error_cm,
                )
                changed = replace(asked, conditions=wrong)
                for seed in asked.seeds:
                    what = f"{scene}, pose error ×{factor:g}"
                    answers = performed(film_set, trial, taken, changed, seed=seed, what=what)
                    for name, answer in last_of(answers).items():
                        left[name].setdefault((scene, factor), []).append(answer.camera_left())
    findings = _report(left, asked)
    findings.rows.extend(located(asked))
    findings.rows.extend(calibrated(asked))
    return findings


def _report(left: Mapping[str, Mapping[tuple[str, float], list[Left]]], asked: Asked) -> Findings:
    findings = Findings()
    conditions = asked.conditions
    for method, cases in left.items():
        usual = np.array([value for (_, f), seen in cases.items() if f == 1.0 for value in seen])
        for column, unit, bar in ((0, "deg", BAR_DEG), (1, "mm", BAR_MM)):
            values = spread(usual[:, column])
            name = f"camera.left_{unit}"
            limit = own_bar(method, bar)
            findings.rows.append(at_most(row_name(method, name), values.mean, unit, bar=limit))
            findings.rows.append(Row(row_name(method, f"{name}.max"), values.max, unit))
        lines = [["room, error at first", "mean deg", "max deg", "mean mm", "max mm"]]
        for (scene, factor), seen in cases.items():
            turned, shifted = (spread(np.array(seen)[:, column]) for column in (0, 1))
            at_first = (
                f"{scene}, {factor * conditions.pose_error_deg:g}° "
                f"{factor * conditions.pose_error_cm:g} cm"
            )
            cells = (turned.mean, turned.max, shifted.mean, shifted.max)
            lines.append([at_first, *(f"{value:.3f}" for value in cells)])
            for unit, values in (("deg", turned), ("mm", shifted)):
                name = f"camera.{scene}.x{factor:g}.left_{unit}"
                findings.rows.append(Row(row_name(method, name), values.mean, unit))
        findings.text.append(f"camera: {TITLES[method]}\n{aligned(lines)}")
    findings.drawings.append(Drawing("camera", lambda figure: _draw(figure, left)))
    return findings


def _draw(figure: Figure, left: Mapping[str, Mapping[tuple[str, float], list[Left]]]) -> None:
    axes = figure.add_subplot()
    for method, cases in left.items():
        for (scene, factor), seen in cases.items():
            turned, shifted = np.array(seen).T
            marker = "o" if scene == "lab" else "s"
            label = f"{scene}, {TITLES[method]}" if factor == 1.0 else None
            axes.plot(
                np.maximum(turned, 1e-3),
                np.maximum(shifted, 1e-2),
                marker,
                ms=4 + 2 * FACTORS.index(factor),
                color=OWN if method == "own" else OTHER,
                alpha=0.7,
                label=label,
            )
    axes.axvline(BAR_DEG, color="0.5", lw=1, ls="--")
    axes.axhline(BAR_MM, color="0.5", lw=1, ls="--")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("turn left over, deg (larger dots: 2 and 4 times the error at first)")
    axes.set_ylabel("shift left over, mm")
    axes.legend()
