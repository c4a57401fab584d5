"""The figures of random rooms, as those of a dataset: right, flagged, left alone, known well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.evaluate.answers import (
    MIN_VISIBLE,
    REST_BAR_CM,
    Answer,
    calibration_error,
    flips,
    is_asked,
    is_right,
    is_unflagged,
    mean_world_cm,
    mean_yaw_deg,
    rest_moved_cm,
)
from benchmarks.evaluate.findings import own_bar, row_name
from benchmarks.evaluate.random_rooms.staging import COLD, SEQUENCE
from benchmarks.evaluate.random_rooms.tracking import TrackedRoom
from scenes.state import TrackState
from studio.console.rows import Row, at_least, at_most

BARS = {
    "right_percent": 95.0,
    "wrong_unflagged_percent": 1.0,
    "confidence.ece": 0.05,
    "step_ms.p95": 60.0,
}
"""Those of a foreign room (`dataset.cold.*`, `dataset.step_ms.p95`)."""


def room_rows(method: str, rooms: Sequence[TrackedRoom]) -> list[Row]:
    """Return a method's figures over all rooms.

    Args:
        method: its name; only our own is held to bars.
        rooms: what it reported in each.
    """
    answers = [judged.answer for room in rooms for judged in room.judged]
    asked = [a for a in answers if a.session == COLD and is_asked(a)]
    count = max(len(asked), 1)
    right = 100.0 * sum(map(is_right, asked)) / count
    unflagged = 100.0 * sum(is_unflagged(a) and not is_right(a) for a in asked) / count
    moved, too_far = rest_moved_cm(answers)
    bar = {name: own_bar(method, value) for name, value in BARS.items()}
    ece, yaw = calibration_error(asked), mean_yaw_deg(asked)

    def name(figure: str) -> str:
        return row_name(method, f"random_rooms.{figure}")

    return [
        at_least(name("right_percent"), right, "%", bar=bar["right_percent"]),
        Row(name("of"), float(len(asked)), ""),
        at_most(name("wrong_unflagged_percent"), unflagged, "%",
                bar=bar["wrong_unflagged_percent"]),
        at_most(name("rest.moved_cm.max"), moved, "cm", bar=own_bar(method, REST_BAR_CM)),
        Row(name("rest.moved"), float(too_far), ""),
        at_most(name("confidence.ece"), ece, "", bar=bar["confidence.ece"]),
        Row(name("world_cm.mean"), mean_world_cm(asked), "cm"),
        Row(name("yaw_deg.mean"), yaw, "deg"),
        Row(name("flips"), float(flips(asked)), ""),
        *_sequence_rows(method, rooms),
        *_duration_rows(method, rooms),
    ]  # fmt: skip


def _sequence_rows(method: str, rooms: Sequence[TrackedRoom]) -> list[Row]:
    """Of the objects that are moved in the sequence, where they are seen."""
    seen: list[Answer] = []
    for room in rooms:
        seen += [
            judged.answer
            for judged in room.judged
            if judged.answer.session == SEQUENCE
            and judged.answer.object_id in room.moving
            and judged.answer.is_moved
            and judged.answer.seen.fraction >= MIN_VISIBLE
        ]
    lost = sum(answer.state in (None, TrackState.LOST) for answer in seen)
    right = 100.0 * sum(map(is_right, seen)) / max(len(seen), 1)
    prefix = row_name(method, "random_rooms.sequence")
    return [
        Row(f"{prefix}.right_percent", right, "%"),
        Row(f"{prefix}.of", float(len(seen)), ""),
        Row(f"{prefix}.lost_frames", float(lost), ""),
        Row(f"{prefix}.world_cm.mean", mean_world_cm(seen), "cm"),
    ]


def _duration_rows(method: str, rooms: Sequence[TrackedRoom]) -> list[Row]:
    steps = [ms for room in rooms for ms in room.step_ms] or [0.0]
    first = [ms for room in rooms for ms in room.first_ms] or [0.0]
    p95, bar = float(np.percentile(steps, 95)), own_bar(method, BARS["step_ms.p95"])
    return [
        Row(row_name(method, "random_rooms.step_ms.p50"), float(np.median(steps)), "ms"),
        at_most(row_name(method, "random_rooms.step_ms.p95"), p95, "ms", bar=bar),
        Row(row_name(method, "random_rooms.first_step_ms.p50"), float(np.median(first)), "ms"),
    ]
