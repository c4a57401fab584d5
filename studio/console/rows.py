"""Measured figures: one kind of table and one kind of JSON object for every verb that measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from studio.console.machine import describe_machine, program_version


@dataclass(frozen=True, slots=True)
class Row:
    """One measured figure.

    Attributes:
        name: stable and dotted, such as `raster.error.max`.
        value: the figure; NaN and None both mean "not measured".
        unit: such as "ms", "cm", "deg"; empty for a plain number.
        bar: the limit the figure is held to, or None.
        passed: whether it met the bar; None where there is no bar or no measurement.
        spread: dispersion of the repeats in the same unit (interquartile range), or None.
    """

    name: str
    value: float | None
    unit: str
    bar: float | None = None
    passed: bool | None = None
    spread: float | None = None


def at_most(
    name: str, value: float, unit: str, *, bar: float | None = None, spread: float | None = None
) -> Row:
    """A row that passes when its value is not above the bar."""
    passed = None if bar is None else bool(value <= bar)
    return Row(name, float(value), unit, bar, passed, spread)


def at_least(
    name: str, value: float, unit: str, *, bar: float | None = None, spread: float | None = None
) -> Row:
    """A row that passes when its value is not below the bar."""
    passed = None if bar is None else bool(value >= bar)
    return Row(name, float(value), unit, bar, passed, spread)


def as_json(verb: str, rows: Sequence[Row], seed: int | None = None) -> dict[str, Any]:
    """Return the JSON of every measuring verb's `--json`; values that JSON cannot say are null."""
    return {
        "verb": verb,
        "version": program_version(),
        "machine": describe_machine(),
        "seed": seed,
        "rows": [{key: _plain(value) for key, value in asdict(row).items()} for row in rows],
    }


def as_table(rows: Sequence[Row]) -> str:
    """The rows as aligned text: name, value, unit, spread, bar and verdict."""
    header = ("name", "value", "unit", "spread", "bar", "")
    verdicts = {True: "pass", False: "FAIL", None: ""}
    cells = [header] + [
        (
            row.name,
            _number(row.value),
            row.unit,
            "" if row.spread is None else f"± {_number(row.spread)}",
            "" if row.bar is None else _number(row.bar),
            verdicts[row.passed],
        )
        for row in rows
    ]
    widths = [max(len(line[column]) for line in cells) for column in range(len(header))]
    right_aligned = (1, 3, 4)
    lines = [
        "  ".join(
            cell.rjust(width) if column in right_aligned else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in cells
    ]
    return "\n".join([lines[0], "-" * max(len(line) for line in lines), *lines[1:]])


def exit_code(rows: Sequence[Row]) -> int:
    """1 if any row missed its bar, else 0."""
    return int(any(row.passed is False for row in rows))


def _plain(value: Any) -> Any:
    is_number = isinstance(value, float)
    return None if is_number and not (-float("inf") < value < float("inf")) else value


def _number(value: float | None) -> str:
    if value is None or value != value:
        return "-"
    return f"{value:.4g}"
