"""Figures of two runs side by side: what differs, and whether it got worse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from studio.console.rows import Row

FLOOR_BY_UNIT: Mapping[str, float] = {"cm": 0.1, "mm": 1.0, "deg": 0.1, "px": 0.1}
"""Smallest difference that can count as worse, in the figure's unit: a millimetre, a tenth of a
degree and of a pixel are below what a scan's edges give. Other units have none."""

LOWER_IS_BETTER = frozenset(FLOOR_BY_UNIT)
"""Units of errors: less is better even where a figure has no bar."""

DURATIONS = frozenset({"ms", "s"})
"""Units of durations, which depend on the machine and its load: shown, not judged."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One figure of both runs.

    Attributes:
        name: the figure's.
        unit: of the values.
        a: value in A, or None.
        b: value in B, or None.
        difference: B less A, or None.
        verdict: in words.
        worse: whether it got worse by more than the tolerance.
    """

    name: str
    unit: str
    a: float | None
    b: float | None
    difference: float | None
    verdict: str
    worse: bool


def compare_rows(a: Sequence[Row], b: Sequence[Row], *, tolerance: float) -> list[Compared]:
    """Every figure of either run, in the order of A and then of B.

    Args:
        a: figures of the run that is held to be good.
        b: figures of the other.
        tolerance: share of A's value by which B's may be worse, 0.1 for 10 %.
    """
    first, second = ({row.name: row for row in rows} for rows in (a, b))
    return [
        _compared(name, first.get(name), second.get(name), tolerance)
        for name in dict.fromkeys((*first, *second))
    ]


def as_values(rows: Sequence[Compared]) -> list[dict[str, Any]]:
    """The rows as JSON takes them."""
    return [asdict(row) for row in rows]


def lower_is_better(*rows: Row) -> bool | None:
    """Whether less is better, as a bar or the unit says; None where nothing says it."""
    for row in rows:
        if row.bar is not None and row.value is not None and row.passed is not None:
            if row.value < row.bar:
                return row.passed
            if row.value > row.bar:
                return not row.passed
    return True if rows and rows[0].unit in LOWER_IS_BETTER else None


def _compared(name: str, a: Row | None, b: Row | None, tolerance: float) -> Compared:
    unit = next(row.unit for row in (a, b) if row is not None)
    was, now = (None if row is None else row.value for row in (a, b))
    if a is None or b is None or was is None or now is None:
        where = {(True, False): "only in A", (False, True): "only in B"}
        verdict = where.get((was is not None, now is not None), "not measured")
        return Compared(name, unit, was, now, None, verdict, False)
    difference = now - was
    verdict, worse = _verdict(a, b, was, difference, tolerance)
    return Compared(name, unit, was, now, difference, verdict, worse)


def _verdict(a: Row, b: Row, was: float, difference: float, tolerance: float) -> tuple[str, bool]:
    if difference == 0.0:
        return "same", False
    if a.unit in DURATIONS:
        return "not judged: depends on the machine", False
    less = lower_is_better(a, b)
    if less is None:
        return "differs", False
    loss = difference if less else -difference
    if loss < 0.0:
        return "better", False
    if loss <= tolerance * abs(was):
        return "worse, within the tolerance", False
    if loss <= FLOOR_BY_UNIT.get(a.unit, 0.0):
        return "worse, too little to count", False
    return "worse", True
