"""Results of an evaluation: figures, tables in words, drawings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from matplotlib.figure import Figure

from studio.console.rows import Row, at_most
from studio.evaluate.metrics import PoseError, Spread, error_table

COLUMNS: Mapping[str, str] = {
    "x_cm": "|X| cm",
    "y_cm": "|Y| cm",
    "z_cm": "|Z| cm",
    "world_cm": "world cm",
    "yaw_deg": "yaw deg",
}
"""The paper's columns and their headings. Z is up here; the paper's up is Y."""

FLIP_DEG = 20.0
"""A yaw farther off than this is a flip: another solution, not an inexact one."""

TITLES: Mapping[str, str] = {"own": "own tracker", "paper": "the paper's method"}


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure to be written: a name for the file, and what draws it."""

    name: str
    draw: Callable[[Figure], None]


@dataclass(frozen=True, slots=True)
class Findings:
    """Results of an evaluation.

    Attributes:
        rows: the figures by their stable names; those of the paper's method begin with `paper.`.
        text: tables and remarks for people.
        drawings: made where they are asked for.
    """

    rows: list[Row] = field(default_factory=list[Row])
    text: list[str] = field(default_factory=list[str])
    drawings: list[Drawing] = field(default_factory=list[Drawing])


def row_name(method: str, name: str) -> str:
    """The name of a figure: as it is for our tracker, after `paper.` for the paper's."""
    return name if method == "own" else f"{method}.{name}"


def own_bar(method: str, bar: float | None) -> float | None:
    """Only our tracker is held to the bars."""
    return bar if method == "own" else None


def error_rows(
    method: str,
    prefix: str,
    errors: Sequence[PoseError],
    *,
    bars: Mapping[str, float],
    with_yaw: bool = True,
) -> list[Row]:
    """World and yaw errors as figures, `PREFIX.world_cm.mean` and so on.

    Args:
        method: whose.
        prefix: such as "room".
        errors: of all stations and seeds.
        bars: by name after the prefix, such as "world_cm.mean".
        with_yaw: False for what looks the same from all sides.
    """
    table = error_table(errors)
    rows = []
    for column, unit in (("world_cm", "cm"), ("yaw_deg", "deg")):
        if column == "yaw_deg" and not with_yaw:
            continue
        for statistic in ("mean", "std", "p95", "max"):
            name = f"{column}.{statistic}"
            rows.append(
                at_most(
                    row_name(method, f"{prefix}.{name}"),
                    getattr(table[column], statistic),
                    unit,
                    bar=own_bar(method, bars.get(name)),
                )
            )
    flips = sum(error.yaw_deg > FLIP_DEG for error in errors)
    if with_yaw:
        bar = own_bar(method, bars.get("flips"))
        rows.append(at_most(row_name(method, f"{prefix}.flips"), flips, "", bar=bar))
    return rows


def paper_columns(
    title: str,
    groups: Mapping[str, Sequence[PoseError]],
    *,
    printed: Mapping[str, tuple[float, float]],
) -> str:
    """A table in the paper's columns, mean ± standard deviation, with p95 and max.

    Args:
        title: above it.
        groups: errors by the name of their line; the line over all of them comes first.
        printed: mean and deviation that the paper prints, by column.
    """
    every = [error for group in groups.values() for error in group]
    header = ["", *COLUMNS.values(), "flips", "n"]
    lines = [header]
    overall = error_table(every)
    lines.append(["all", *(_mean_std(overall[c]) for c in COLUMNS), *_counts(every)])
    lines.append(["  p95", *(f"{overall[c].p95:.2f}" for c in COLUMNS), "", ""])
    lines.append(["  max", *(f"{overall[c].max:.2f}" for c in COLUMNS), "", ""])
    for name, errors in groups.items():
        table = error_table(errors)
        lines.append([name, *(_mean_std(table[c]) for c in COLUMNS), *_counts(errors)])
    if printed:
        # The paper's up is Y and ours is Z: its columns are put where they belong.
        swapped = {**printed, "y_cm": printed["z_cm"], "z_cm": printed["y_cm"]}
        lines.append(
            [
                "paper, printed",
                *(f"{swapped[c][0]:.1f} ± {swapped[c][1]:.1f}" for c in COLUMNS),
                "",
                "",
            ]
        )
    return f"{title}\n{aligned(lines)}"


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """Cells as text in columns, the first one to the left and the others to the right."""
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def _mean_std(spread: Spread) -> str:
    return f"{spread.mean:.2f} ± {spread.std:.2f}"


def _counts(errors: Sequence[PoseError]) -> tuple[str, str]:
    return str(sum(error.yaw_deg > FLIP_DEG for error in errors)), str(len(errors))
