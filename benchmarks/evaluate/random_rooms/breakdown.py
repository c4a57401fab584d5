"""Failures of a method by family, finish, size, and visibility."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from benchmarks.evaluate.answers import (
    RIGHT_CM,
    RIGHT_DEG,
    Answer,
    is_asked,
    is_right,
    is_unflagged,
)
from benchmarks.evaluate.findings import FLIP_DEG, aligned
from benchmarks.evaluate.random_rooms.staging import COLD
from benchmarks.evaluate.random_rooms.tracking import Judged, TrackedRoom
from scenes.state import TrackState

RIGHT, LOST, PLACE, YAW, FLIP = "right", "lost", "place", "yaw", "flip"
"""What became of an object: right; called lost or not reported; more than 5 cm off; at its place
with a yaw off by more than 5°; at its place with a yaw off by more than 20°."""

WIDTHS_PX = (24.0, 40.0, 64.0, 100.0, 160.0)
"""Lower ends of the buckets of widths, lens pixels."""

VISIBLE_PERCENT = (50.0, 70.0, 90.0, 99.0)
"""Lower ends of the buckets of visible fractions."""


def outcome(answer: Answer) -> str:
    """Return the outcome of an object in a picture."""
    if is_right(answer):
        return RIGHT
    if answer.error is None or answer.state is TrackState.LOST:
        return LOST
    if answer.error.world_cm > RIGHT_CM:
        return PLACE
    return FLIP if answer.error.yaw_deg > max(FLIP_DEG, RIGHT_DEG) else YAW


def breakdown(rooms: Sequence[TrackedRoom]) -> list[str]:
    """Tables over all objects that a cold start is asked for."""
    asked = [
        judged
        for room in rooms
        for judged in room.judged
        if judged.answer.session == COLD and is_asked(judged.answer)
    ]
    by: tuple[tuple[str, Callable[[Judged], str]], ...] = (
        ("family", lambda j: j.family),
        ("finish", lambda j: j.finish),
        ("width", lambda j: bucket(j.answer.seen.width_px, WIDTHS_PX, "px")),
        (
            "visible",
            lambda j: bucket(100 * j.answer.seen.fraction, VISIBLE_PERCENT, "%"),
        ),
        ("moved", lambda j: "moved" if j.answer.is_moved else "at rest"),
        ("seed", lambda j: str(j.seed)),
    )
    return [_table(title, asked, key) for title, key in by]


def bucket(value: float, lower_ends: Sequence[float], unit: str) -> str:
    """The bucket of a value, such as "40-64 px"; buckets sort as they grow."""
    ends = list(lower_ends)
    index = max(sum(value >= end for end in ends) - 1, 0)
    low = f"{ends[index]:3.0f}"
    high = f"-{ends[index + 1]:.0f}" if index + 1 < len(ends) else " and more"
    return f"{low}{high} {unit}"


def _table(title: str, asked: Sequence[Judged], key: Callable[[Judged], str]) -> str:
    lines: list[list[str]] = [[title, "right", "of", LOST, PLACE, YAW, FLIP, "unflagged"]]
    for name in sorted({key(judged) for judged in asked}):
        answers = [judged.answer for judged in asked if key(judged) == name]
        outcomes = [outcome(answer) for answer in answers]
        counts = [outcomes.count(kind) for kind in (LOST, PLACE, YAW, FLIP)]
        unflagged = sum(is_unflagged(a) and not is_right(a) for a in answers)
        lines.append(
            [
                name,
                str(outcomes.count(RIGHT)),
                str(len(answers)),
                *("." if count == 0 else str(count) for count in (*counts, unflagged)),
            ]
        )
    return aligned(lines)
