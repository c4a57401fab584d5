"""Error curves under the timeline, on the same x axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from studio.app.shell.theme import Theme
from studio.app.timeline.errors import ErrorCurve
from studio.app.timeline.track_view import GUTTER_PX
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG

COLOURS = ("accent", "good", "warning", "bad", "calm")
"""Names of the theme's colours, one a curve, in turn; the dashes differ, too."""

DASHES = (None, (6, 3), (2, 3), (8, 3, 2, 3))
"""Lengths of strokes and gaps in line widths, one a curve, in turn."""


class Curves(QWidget):
    """Position or yaw errors of all objects over seconds; the plot is made when first needed."""

    def __init__(self) -> None:
        super().__init__()
        self.shows_yaw = False
        self._t_ns = 0
        self._plot: Any = None
        self._line: Any = None
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._empty = QLabel("no true poses in this recording: no errors to show")
        self._empty.setContentsMargins(GUTTER_PX, 4, 4, 4)
        self._layout.addWidget(self._empty)

    def show_curves(self, curves: Mapping[str, ErrorCurve], theme: Theme) -> None:
        """Draw these instead of what is there."""
        self._empty.setVisible(not curves)
        if self._plot is not None:
            self._plot.setVisible(bool(curves))
        if not curves:
            return
        import pyqtgraph as pg  # a third of a second: not before there is something to plot

        if self._plot is None:
            self._plot = self._made_plot(pg)
        self._plot.clear()
        self._plot.setBackground(theme.panel)
        for name in ("left", "bottom"):
            self._plot.getAxis(name).setPen(theme.line)
            self._plot.getAxis(name).setTextPen(theme.faint)
        words = "yaw error, °" if self.shows_yaw else "error, cm"
        self._plot.setLabel("left", words, color=theme.faint)
        self._plot.getPlotItem().legend.setLabelTextColor(theme.text)
        for number, (object_id, curve) in enumerate(curves.items()):
            dash = DASHES[number % len(DASHES)]
            pen = pg.mkPen(getattr(theme, COLOURS[number % len(COLOURS)]), width=1.5, dash=dash)
            errors = curve.yaw_deg if self.shows_yaw else curve.world_cm
            self._plot.plot(curve.t_ns / 1e9, errors, pen=pen, name=object_id)
        limit = ROOM_BAR_DEG if self.shows_yaw else ROOM_BAR_CM
        bar = pg.InfiniteLine(limit, angle=0, pen=pg.mkPen(theme.faint, dash=(4, 4)))
        self._plot.addItem(bar, ignoreBounds=True)
        self._line = pg.InfiniteLine(
            self._t_ns / 1e9, angle=90, pen=pg.mkPen(theme.accent, width=2)
        )
        self._plot.addItem(self._line, ignoreBounds=True)

    def show_span(self, from_ns: int, to_ns: int) -> None:
        """Show the part that the rows above show."""
        if self._plot is not None:
            self._plot.setXRange(from_ns / 1e9, to_ns / 1e9, padding=0)

    def set_playhead(self, t_ns: int) -> None:
        """Where the recording is."""
        self._t_ns = t_ns
        if self._line is not None:
            self._line.setValue(t_ns / 1e9)

    def _made_plot(self, pg: Any) -> Any:
        plot: Any = pg.PlotWidget()
        plot.setMouseEnabled(x=False, y=False)
        plot.hideButtons()
        plot.setMenuEnabled(False)
        plot.getAxis("left").setWidth(GUTTER_PX)
        plot.getPlotItem().layout.setContentsMargins(0, 2, 0, 2)
        plot.addLegend(offset=(-8, 4), colCount=3)
        plot.setLimits(yMin=0)
        self._layout.addWidget(plot)
        return plot
