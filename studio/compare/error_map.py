"""Floor plans of two runs: where on the floor the tracker was how far off, and paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from scenes.package import ScenePackage
from scenes.state import ObjectModel
from studio.compare.floor_cells import CELL_M, MIN_RANGE_CM, cells_of, mean_errors
from studio.compare.run import Run
from studio.evaluate.figures import (
    COLOURS,
    INK,
    OTHER,
    OWN,
    Background,
    as_svg,
    draw_paths,
    figure_style,
)

PICTURE_STEP = 2
"""Every how manieth pixel of the picture from above is drawn: the plans are a third as wide."""


def moved_objects(runs: Sequence[Run]) -> list[ObjectModel]:
    """Objects that moved in any of the runs, in the order of the scene."""
    found = {model.object_id: model for run in runs for model in run.board.moved()}
    order = runs[0].board.object_ids()
    return sorted(found.values(), key=lambda model: order.index(model.object_id))


def error_maps(scene: ScenePackage, a: Run, b: Run, background: Background) -> str:
    """A, B, and B less A, as one drawing."""
    low, high = scene.footprint_m
    shape = cells_of(scene.footprint_m)
    maps = [mean_errors(run.board, low, shape) for run in (a, b)]
    difference = maps[1] - maps[0]
    top = max(MIN_RANGE_CM, *(float(np.nanmax(m, initial=0.0)) for m in maps))
    side = max(MIN_RANGE_CM, float(np.nanmax(np.abs(difference), initial=0.0)))
    with figure_style():
        aspect = float((high[1] - low[1]) / (high[0] - low[0]))
        figure = Figure(figsize=(12.6, 4.0 * aspect + 1.3), layout="constrained")
        left, middle, right = figure.subplots(1, 3, sharey=True)
        for axes, run, values in ((left, a, maps[0]), (middle, b, maps[1])):
            _floor(axes, scene, background)
            shown = _cells(axes, values, low, "YlOrRd", (0.0, top))
            for colour, model in zip(COLOURS * 8, moved_objects((a, b)), strict=False):
                if run.board.samples(model.object_id):
                    draw_paths(axes, model, run.board.samples(model.object_id), colour)
            axes.set_title(f"{run.name}: {run.scenario_names}", loc="left", fontsize=10)
        figure.colorbar(
            shown, ax=[left, middle], location="bottom", aspect=50, label="mean error (cm)"
        )
        _floor(right, scene, background)
        shown = _cells(right, difference, low, "RdBu_r", (-side, side))
        for run, colour in ((a, OWN), (b, OTHER)):
            _true_paths(right, run, moved_objects((a, b)), colour)
        right.set_title("B less A", loc="left", fontsize=10)
        figure.colorbar(shown, ax=right, location="bottom", aspect=25, label="red: B is worse (cm)")
        return as_svg(figure, "Floor plans with the tracker's error in A, in B, and B less A")


def _floor(axes: Axes, scene: ScenePackage, background: Background) -> None:
    picture, extent = background
    low, high = scene.footprint_m
    small = picture[::PICTURE_STEP, ::PICTURE_STEP]
    axes.imshow(small, extent=extent, alpha=0.35, interpolation="bilinear", zorder=0)
    corner, size = (float(low[0]), float(low[1])), [float(v) for v in high - low]
    axes.add_patch(Rectangle(corner, *size, fill=False, edgecolor=INK, linewidth=1.6))
    eye = scene.world_from_rig.translation
    axes.plot(eye[0], eye[1], marker="^", markersize=8, color=INK, linestyle="none")
    axes.set_xlim(low[0] - 0.1, high[0] + 0.1)
    axes.set_ylim(low[1] - 0.1, high[1] + 0.1)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")


def _cells(
    axes: Axes,
    values: NDArray[np.float64],
    low: NDArray[Any],
    colours: str,
    ends: tuple[float, float],
) -> Any:
    rows, columns = values.shape
    x = low[0] + CELL_M * np.arange(columns + 1)
    y = low[1] + CELL_M * np.arange(rows + 1)
    masked = np.ma.masked_invalid(values)
    return axes.pcolormesh(
        x, y, masked, cmap=colours, vmin=ends[0], vmax=ends[1], alpha=0.75, zorder=1
    )


def _true_paths(axes: Axes, run: Run, models: Sequence[ObjectModel], colour: str) -> None:
    label: str | None = f"true paths in {run.name}"
    for model in models:
        path = [
            s.true_world_from_object.translation[:2] for s in run.board.samples(model.object_id)
        ]
        if path:
            axes.plot(*np.array(path).T, color=colour, linewidth=1.6, label=label)
            label = None
    if label is None:
        axes.legend(fontsize=8, loc="upper right")
