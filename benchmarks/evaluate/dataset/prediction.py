"""Errors that a rehearsal foretold, against those that were measured in the real room."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.evaluate.answers import (
    Answer,
    is_asked,
    is_right,
    mean_world_cm,
    mean_yaw_deg,
)
from benchmarks.evaluate.dataset.layout import Dataset
from studio.console.rows import Row, at_most

PREFIX = "twin.rehearsed_vs_measured"
FACTOR_BAR = 2.0
MIN_CM, MIN_DEG = 0.01, 0.01
"""Errors below these are the same: nobody sees a tenth of a millimetre."""


def prediction_rows(
    dataset: Dataset, *, rehearsed: Sequence[Answer], measured: Sequence[Answer]
) -> list[Row]:
    """How well rehearsed errors predict measured ones, of the objects that move.

    World and yaw are of poses that are right (within 5 cm and 5°); how often poses are right is a
    row of its own, since one object reported across the room outweighs a hundred good answers.
    `.all` counts every answer, lost ones too.
    """
    foretold, found = _asked(dataset, rehearsed), _asked(dataset, measured)
    foretold_right = [a for a in foretold if is_right(a)]
    found_right = [a for a in found if is_right(a)]
    rows: list[Row] = []
    for name, mean, least in (
        ("world", mean_world_cm, MIN_CM),
        ("yaw", mean_yaw_deg, MIN_DEG),
    ):
        unit = "cm" if name == "world" else "deg"
        a, b = mean(foretold_right), mean(found_right)
        rows += [
            at_most(f"{PREFIX}.{name}", factor(a, b, least=least), "", bar=FACTOR_BAR),
            Row(f"twin.rehearsed.{name}_{unit}.mean", a, unit),
            Row(f"twin.measured.{name}_{unit}.mean", b, unit),
            Row(f"{PREFIX}.{name}.all", factor(mean(foretold), mean(found), least=least), ""),
        ]
    for name, right, asked in (
        ("rehearsed", foretold_right, foretold),
        ("measured", found_right, found),
    ):
        rows.append(Row(f"twin.{name}.right_percent", 100.0 * len(right) / max(len(asked), 1), "%"))
    return [*rows, Row("twin.asked", float(len(found)), "")]


def factor(first: float, second: float, *, least: float) -> float:
    """The larger over the smaller, at least 1; below `least` all are the same."""
    low, high = sorted((max(first, least), max(second, least)))
    return high / low


def _asked(dataset: Dataset, answers: Sequence[Answer]) -> list[Answer]:
    """Those of moving objects that are seen well enough, each still a session of its own."""
    return [
        answer
        for answer in answers
        if answer.session in dataset.sets
        and answer.object_id in dataset.sets[answer.session].moving
        and is_asked(answer)
    ]
