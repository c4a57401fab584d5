"""Writes an evaluation's figures: PNG to look at, SVG to print."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from benchmarks.evaluate.findings import Drawing
from studio.console.machine import describe_machine, program_version

_STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.2,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "gaussiannexus",
}


def write_drawings(drawings: Sequence[Drawing], folder: Path, *, caption: str) -> list[Path]:
    """Draw every figure into a folder; returns the files.

    Args:
        drawings: what to draw.
        folder: made where it is missing.
        caption: under each figure: what was run; version and machine are added.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    machine = describe_machine()
    processor = f"{machine['cpu']} ({machine['vectors']})"
    place = f"{processor}, {machine['cores']} cores, version {program_version()}"
    written = []
    for drawing in drawings:
        with mpl.rc_context(_STYLE):
            figure = Figure(figsize=(8.0, 5.4), layout="constrained")
            FigureCanvasAgg(figure)
            drawing.draw(figure)
            for axes in figure.axes:
                _plain_numbers(axes)
            figure.supxlabel(f"{caption}\n{place}", fontsize=7, color="0.4")
            for suffix in (".png", ".svg"):
                path = folder / f"{drawing.name}{suffix}"
                figure.savefig(path, dpi=150)
                written.append(path)
    return written


def _plain_numbers(axes: Axes) -> None:
    """Logarithmic scales marked 1, 2, 5, 10 rather than by powers."""
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            axis.set_major_locator(LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
