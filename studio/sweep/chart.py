"""One plot of a sweep as SVG: a figure against a fault's size, every seed a point."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from statistics import median

WIDTH, HEIGHT = 460, 250
LEFT, RIGHT, TOP, BOTTOM = 52, 14, 14, 40
HEADROOM = 1.08
"""The highest value stands this far below the top."""

TICKS = 5

Placed = Callable[[float], float]
"""A value's place on an axis, in the drawing's units."""


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a plot.

    Attributes:
        tracker: colours it.
        is_strong: a full line; otherwise a thin dashed one, with hollow points.
        values: of each seed, by size; sizes without any value have no point.
        without: of each seed, without the fault.
    """

    tracker: str
    is_strong: bool
    values: Mapping[float, Sequence[float]]
    without: Sequence[float]


def chart(series: Sequence[Series], *, size_label: str, value_label: str, floor: float) -> str:
    """The plot; its colours come from the page.

    Args:
        series: at least one.
        size_label: what runs along, with its unit.
        value_label: what runs up, with its unit.
        floor: the vertical axis reaches at least here.
    """
    sizes = sorted({size for one in series for size in one.values})
    highest = max(
        [v for one in series for vs in (*one.values.values(), one.without) for v in vs],
        default=0.0,
    )
    top = HEADROOM * max(highest, floor)
    low, high = min(0.0, *sizes), max(0.0, *sizes)
    high = high if high > low else low + 1.0

    def x(size: float) -> float:
        return LEFT + (size - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        return HEIGHT - BOTTOM - value / top * (HEIGHT - TOP - BOTTOM)

    parts = [_frame(top, y), _along(sizes, x)]
    for one in series:
        parts.append(_drawn(one, x, y))
    middle = LEFT + 0.5 * (WIDTH - LEFT - RIGHT)
    parts.append(f'<text class="label" x="{middle:g}" y="{HEIGHT - 6}">{escape(size_label)}</text>')
    title = escape(f"{value_label} against {size_label}")
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}">'
        f"<title>{title}</title>{''.join(parts)}</svg>"
    )


def _frame(top: float, y: Placed) -> str:
    step = _round_step(top / TICKS)
    lines: list[str] = []
    for k in range(int(top / step) + 1):
        at, value = y(k * step), k * step
        lines.append(_level("grid", at))
        lines.append(f'<text class="up" x="{LEFT - 6}" y="{at + 4:.1f}">{value:.4g}</text>')
    return "".join(lines)


def _level(kind: str, at: float) -> str:
    ends = f'x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"'
    return f'<line class="{kind}" {ends}/>'


def _along(sizes: Sequence[float], x: Placed) -> str:
    return "".join(
        f'<text class="along" x="{x(size):.1f}" y="{HEIGHT - BOTTOM + 16}">{size:g}</text>'
        for size in sizes
    )


def _drawn(one: Series, x: Placed, y: Placed) -> str:
    name = f"{escape(one.tracker)}{'' if one.is_strong else ' weak'}"
    parts: list[str] = []
    if one.without:
        at = y(median(one.without))
        parts.append(_level("without", at))
    middles = [(x(s), y(median(v))) for s, v in sorted(one.values.items()) if v]
    if len(middles) > 1:
        way = " ".join(f"{a:.1f},{b:.1f}" for a, b in middles)
        parts.append(f'<polyline points="{way}"/>')
    for size, values in sorted(one.values.items()):
        for value in values:
            parts.append(
                f'<circle cx="{x(size):.1f}" cy="{y(value):.1f}" r="3.5">'
                f"<title>{size:g}: {value:.3g}</title></circle>"
            )
    return f'<g class="series {name}">{"".join(parts)}</g>'


def _round_step(step: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** len(str(int(step))) / 10.0 if step >= 1.0 else 1.0
    while power > step:
        power /= 10.0
    return next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= step - 1e-12)
