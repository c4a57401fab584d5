"""The report's drawings as inline SVG. Ink follows the page's text colour, in light and in dark."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import ObjectModel
from studio.evaluate.samples import Sample
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG, VISIBLE_FRACTION, ScoreBoard

INK = "#010203"
"""Stands for the page's text colour until the figure is written."""

COLOURS = ("#1f88d1", "#d98a00", "#12a37c", "#c96fa4", "#d9601f", "#56b4e9", "#8a78ba")
"""One per object: Okabe and Ito's hues, distinct for colour-blind eyes, for light and dark."""

SMALLEST_SHOWN = 0.05
"""Centimetres or degrees: lower end of the error charts, whose scale is logarithmic."""

OWN, OTHER = "#1f88d1", "#d9601f"
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "gaussiannexus",
    "font.family": "sans-serif",
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": INK,
    "grid.alpha": 0.12,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
}

Background = tuple[NDArray[np.uint8], tuple[float, float, float, float]]
"""A picture from above and the floor it covers: low x, high x, low y, high y in metres."""


def floor_plan(
    scene: ScenePackage,
    board: ScoreBoard,
    world_from_rig: Pose,
    background: Background | None = None,
) -> str:
    """The room from above: true and tracked path of every moved object, and the camera."""
    low, high = scene.footprint_m
    with figure_style():
        width = 7.2
        figure = Figure(figsize=(width, width * float((high[1] - low[1]) / (high[0] - low[0])) + 1))
        axes = figure.add_axes((0.08, 0.14, 0.9, 0.84))
        if background is not None:
            picture, extent = background
            axes.imshow(picture, extent=extent, alpha=0.42, interpolation="bilinear", zorder=0)
        outline = Rectangle(
            (float(low[0]), float(low[1])),
            *(float(v) for v in high - low),
            fill=False,
            edgecolor=INK,
            linewidth=1.6,
        )
        axes.add_patch(outline)
        for colour, model in zip(_cycle(COLOURS), board.moved(), strict=False):
            draw_paths(axes, model, board.samples(model.object_id), colour)
        eye = world_from_rig.translation
        axes.plot(eye[0], eye[1], marker="^", markersize=9, color=INK, linestyle="none")
        axes.annotate("360° camera", (eye[0], eye[1]), (7, 5), textcoords="offset points")
        axes.set_xlim(low[0] - 0.1, high[0] + 0.1)
        axes.set_ylim(low[1] - 0.1, high[1] + 0.1)
        axes.set_aspect("equal")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        legend = [
            axes.plot([], [], color=INK, linewidth=3.5, alpha=0.35, label="true path")[0],
            axes.plot([], [], color=INK, linewidth=1.4, label="tracked path")[0],
            axes.plot([], [], "o", color=INK, markerfacecolor="none", label="start")[0],
            axes.plot([], [], "s", color=INK, label="end")[0],
        ]
        axes.legend(
            handles=legend, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4, fontsize=9
        )
        return as_svg(figure, "Floor plan with true and tracked paths")


def errors_over_time(boards: Mapping[str, ScoreBoard], *, mark_s: float | None = None) -> str:
    """Position and yaw error of every moved object; spans in which it was hidden are shaded.

    Args:
        boards: scores by method.
        mark_s: an instant to mark, or None.
    """
    first = next(iter(boards.values()))
    models = first.moved()
    with figure_style():
        figure = Figure(figsize=(10, 1.0 + 1.35 * len(models)), layout="constrained")
        grid = figure.subplots(len(models), 2, sharex=True, squeeze=False)
        columns = (("world_cm", ROOM_BAR_CM, "cm"), ("yaw_deg", ROOM_BAR_DEG, "°"))
        for row, model in zip(grid, models, strict=True):
            for axes, (column, bar, unit) in zip(row, columns, strict=True):
                if column == "yaw_deg" and not first.has_yaw(model.object_id):
                    _say(axes, "round: its yaw cannot be seen")
                    continue
                _draw_errors(axes, boards, model, column=column, bar=bar)
                if mark_s is not None:
                    axes.axvline(mark_s, color=INK, linewidth=1.0, linestyle=":")
                axes.set_ylabel(unit, rotation=0, labelpad=10)
            row[0].set_title(model.name, loc="left", fontsize=10, fontweight="bold")
        grid[0][1].set_title("yaw error", loc="right", fontsize=9)
        grid[0][0].set_title("position error", loc="right", fontsize=9)
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        return as_svg(figure, "Error over time of every moved object")


def visibility(board: ScoreBoard) -> str:
    """How much of every moved object the camera saw."""
    models = board.moved()
    with figure_style():
        figure = Figure(figsize=(10, 0.7 + 0.62 * len(models)), layout="constrained")
        grid = figure.subplots(len(models), 1, sharex=True, squeeze=False)[:, 0]
        for axes, model, colour in zip(grid, models, _cycle(COLOURS), strict=False):
            samples = board.samples(model.object_id)
            times = [s.t_ns / 1e9 for s in samples]
            seen = [100 * s.visible for s in samples]
            axes.fill_between(times, seen, color=colour, alpha=0.55, linewidth=0)
            axes.axhline(100 * VISIBLE_FRACTION, color=INK, linewidth=0.6, linestyle=":")
            axes.set_ylim(0, 105)
            axes.set_yticks([0, 50, 100], ["0", "50", "100 %"], fontsize=7)
            axes.margins(x=0)
            axes.set_ylabel(model.name, rotation=0, ha="right", va="center", labelpad=28)
        grid[-1].set_xlabel("time (s)")
        return as_svg(figure, "Share of every moved object in sight")


def draw_paths(axes: Axes, model: ObjectModel, samples: Sequence[Sample], colour: str) -> None:
    """One object's true path, wide and pale, and its tracked one; where they start and end."""
    true = np.array([s.true_world_from_object.translation[:2] for s in samples])
    tracked = np.array([s.estimated_world_from_object.translation[:2] for s in samples])
    axes.plot(*true.T, color=colour, linewidth=5, alpha=0.35, solid_capstyle="round")
    axes.plot(*tracked.T, color=colour, linewidth=1.5)
    axes.plot(*true[0], "o", color=colour, markerfacecolor="none", markersize=7)
    axes.plot(*tracked[-1], "s", color=colour, markersize=6)
    axes.annotate(
        model.name,
        (float(true[-1][0]), float(true[-1][1])),
        (8, -4),
        textcoords="offset points",
        color=colour,
        fontweight="bold",
        fontsize=9,
    )


def _draw_errors(
    axes: Axes,
    boards: Mapping[str, ScoreBoard],
    model: ObjectModel,
    *,
    column: str,
    bar: float,
) -> None:
    top = 3.0 * bar
    styles = ((OWN, 1.6), (OTHER, 1.0), (INK, 0.8))
    for (name, board), (colour, width) in zip(boards.items(), styles, strict=False):
        samples = [s for s in board.samples(model.object_id) if s.counted]
        times = np.array([s.t_ns / 1e9 for s in samples])
        values = np.array([getattr(s.error, column) for s in samples]).clip(SMALLEST_SHOWN)
        axes.plot(times, values, color=colour, linewidth=width, label=name)
        top = max(top, 1.3 * float(values.max(initial=0.0)))
        if name == next(iter(boards)):
            hidden = np.array([s.visible < VISIBLE_FRACTION for s in samples], dtype=bool)
            axes.fill_between(
                times, 0, 1, where=hidden, transform=axes.get_xaxis_transform(),
                color=INK, alpha=0.1, linewidth=0, step="mid",
            )  # fmt: skip
    axes.axhline(bar, color=INK, linewidth=0.8, linestyle="--")
    axes.set_yscale("log")
    axes.set_ylim(SMALLEST_SHOWN, top)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.grid(visible=True, axis="y")
    axes.margins(x=0)


def figure_style() -> AbstractContextManager[None]:
    """The look of every drawing: ink that follows the page, quiet axes."""
    return mpl.rc_context(_STYLE)


def _say(axes: Axes, text: str) -> None:
    axes.set_yticks([])
    axes.tick_params(bottom=False)
    axes.spines[:].set_visible(False)
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, fontsize=9)


def _cycle(colours: Sequence[str]) -> Sequence[str]:
    return tuple(colours) * 8


def as_svg(figure: Figure, title: str) -> str:
    """The drawing as inline SVG with a title for those who do not see it."""
    buffer = io.StringIO()
    FigureCanvasSVG(figure)
    figure.savefig(
        buffer, format="svg", bbox_inches="tight", metadata={"Date": None, "Title": title}
    )
    text = buffer.getvalue()
    start = text.index("<svg")
    return text[start:].replace(INK, "currentColor").replace("<svg ", '<svg role="img" ', 1)
