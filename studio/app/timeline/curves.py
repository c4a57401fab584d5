"""Error curves under the timeline, on the same x axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from studio.app.shell.theme import Theme
from studio.app.timeline.recorded.errors import ErrorCurve
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG

GUTTER_PX = 132
"""Width of the names at the left; the curves' axis is as wide, so that both share one x axis."""

COLOURS = ("accent", "good", "warning", "bad", "calm")
"""Names of the theme's colours, one a curve, in turn; the dashes differ, too."""

DASHES = (None, (6, 3), (2, 3), (8, 3, 2, 3))
"""Lengths of strokes and gaps in line widths, one a curve, in turn."""

MIN_PX = 56
"""Height below which curves say nothing."""


def curve_pen(theme: Theme, number: int) -> QPen:
    """The line of an object, by its number among the rows: beside its name, and as its curve."""
    pen = QPen(QColor(getattr(theme, COLOURS[number % len(COLOURS)])), 1.5)
    pen.setCosmetic(True)
    dash = DASHES[number % len(DASHES)]
    if dash is not None:
        pen.setDashPattern(list(dash))
    return pen


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
        self.setMinimumHeight(MIN_PX)
        self._empty = QLabel(
            "No errors to show: this recording does not say where its objects truly were."
        )
        self._empty.setObjectName("faint")
        self._empty.setContentsMargins(GUTTER_PX, 4, 4, 4)
        self._layout.addWidget(self._empty)
        # Beside the axis, not along it: upright words are cut where the curves are low.
        self.unit = QLabel(self)
        self.unit.setObjectName("faint")
        self.unit.move(8, 2)
        self.unit.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.unit.hide()

    def show_curves(self, curves: Mapping[str, ErrorCurve], theme: Theme) -> None:
        """Draw these instead of what is there."""
        self._empty.setVisible(not curves)
        if self._plot is not None:
            self._plot.setVisible(bool(curves))
        if not curves:
            self.unit.hide()
            return
        import pyqtgraph as pg  # a third of a second: not before there is something to plot

        if self._plot is None:
            self._plot = self._made_plot(pg)
        self._plot.clear()
        self._plot.setBackground(theme.panel)
        self._plot.getAxis("left").setPen(theme.line)
        self._plot.getAxis("left").setTextPen(theme.faint)
        self.unit.setText("heading\noff by, °" if self.shows_yaw else "place\noff by, cm")
        self.unit.adjustSize()
        self.unit.show()
        self.unit.raise_()
        self._plot.setToolTip("the dashed line is the limit")
        for number, curve in enumerate(curves.values()):
            errors = curve.yaw_deg if self.shows_yaw else curve.world_cm
            self._plot.plot(curve.t_ns / 1e9, errors, pen=curve_pen(theme, number))
        limit = ROOM_BAR_DEG if self.shows_yaw else ROOM_BAR_CM
        bar = pg.InfiniteLine(limit, angle=0, pen=pg.mkPen(theme.faint, dash=(4, 4)))
        self._plot.addItem(bar, ignoreBounds=True)
        self._line = pg.InfiniteLine(
            self._t_ns / 1e9, angle=90, pen=pg.mkPen(theme.accent, width=2)
        )
        self._plot.addItem(self._line, ignoreBounds=True)

    def leave_right(self, width_px: int) -> None:
        """Leave so much free at the right."""
        self._layout.setContentsMargins(0, 0, width_px, 0)

    def show_span(self, from_ns: int, to_ns: int) -> None:
        """Show the part that the rows above show."""
        if self._plot is not None:
            self._plot.setXRange(from_ns / 1e9, to_ns / 1e9, padding=0)

    def set_playhead(self, t_ns: int) -> None:
        """Move the playhead."""
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
        plot.hideAxis("bottom")  # the ruler above is its axis
        plot.setLimits(yMin=0)
        self._layout.addWidget(plot)
        return plot
