"""Plots of a study as inline SVG: every participant under every condition, and answers by item."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from studio.evaluate.figures import COLOURS, INK, as_svg, figure_style
from studio.study.results.statistics import described

JITTER = 0.05
"""How far apart the same values are drawn, as a share of the distance of two conditions."""

ANSWER_COLOURS = ("#b35806", "#f1a340", "#c9cdd3", "#92c5de", "#2166ac", "#1b4f86", "#123a66")
"""Of answers from the lowest to the highest, distinct for colour-blind eyes; five points take those
of both ends and the middle."""


def condition_plot(
    title: str,
    values: Mapping[str, Mapping[str, float]],
    *,
    unit: str,
    published: tuple[str, float] | None = None,
) -> str:
    """Return a plot of a measure: a dot a participant, a line a person, means with intervals.

    Args:
        title: of the measure.
        values: by condition, by participant.
        unit: of the measure.
        published: a figure beside, and whose it is.
    """
    with figure_style():
        figure = Figure(figsize=(1.5 + 1.15 * max(len(values), 1), 2.7))
        axes = figure.subplots()
        conditions = list(values)
        people = sorted({p for each in values.values() for p in each})
        rng = np.random.default_rng(0)
        beside = {person: float(rng.uniform(-JITTER, JITTER)) for person in people}
        for person in people:
            at = [(k, values[c][person]) for k, c in enumerate(conditions) if person in values[c]]
            x = [k + beside[person] for k, _ in at]
            y = [value for _, value in at]
            axes.plot(x, y, "-", color=INK, alpha=0.25, linewidth=0.8)
            axes.plot(x, y, "o", color=INK, alpha=0.55, markersize=3.5)
        for k, condition in enumerate(conditions):
            if not values[condition]:
                continue
            found, colour = described(list(values[condition].values())), COLOURS[k % len(COLOURS)]
            axes.plot([k + 0.22], [found.mean], "D", color=colour, markersize=6)
            if np.isfinite([found.low, found.high]).all():
                axes.plot([k + 0.22] * 2, [found.low, found.high], "-", color=colour, linewidth=2.2)
        if published is not None:
            whose, value = published
            axes.axhline(value, color=INK, linestyle=":", linewidth=1.0)
            axes.text(0.99, value, whose, ha="right", va="bottom", fontsize=8,
                      transform=axes.get_yaxis_transform())  # fmt: skip
        axes.set_xticks(range(len(conditions)), conditions)
        axes.set_xlim(-0.5, len(conditions) - 0.4)
        axes.set_ylabel(unit)
        axes.grid(visible=True, axis="y")
        return as_svg(figure, title)


def answers_plot(title: str, rows: Sequence[tuple[str, Sequence[int]]], *, points: int) -> str:
    """Return a plot of how often each answer was given, a bar a row.

    Args:
        title: of the plot.
        rows: words beside a bar, and the answers.
        points: of the scale, at most seven.
    """
    colours = ANSWER_COLOURS if points > 5 else ANSWER_COLOURS[:5]
    with figure_style():
        figure = Figure(figsize=(6.6, 0.55 + 0.3 * max(len(rows), 1)))
        axes = figure.subplots()
        for place, (_, answers) in enumerate(rows):
            left = 0.0
            for answer in range(1, points + 1):
                share = 100.0 * sum(a == answer for a in answers) / max(len(answers), 1)
                colour = colours[round((answer - 1) * (len(colours) - 1) / max(points - 1, 1))]
                axes.barh(place, share, left=left, color=colour, height=0.72)
                if share >= 9.0:
                    dark = colour not in ("#c9cdd3", "#92c5de", "#f1a340")
                    axes.text(left + share / 2, place, str(answer), ha="center", va="center",
                              fontsize=8, color="white" if dark else "black")  # fmt: skip
                left += share
        axes.set_yticks(range(len(rows)), [words for words, _ in rows])
        axes.invert_yaxis()
        axes.set_xlim(0, 100)
        axes.set_xlabel("% of answers")
        return as_svg(figure, title)
