"""Rows of states over the curves of errors: one part of the time, as wide in both."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QScrollArea, QSplitter

from studio.app.shell.theme import Theme
from studio.app.timeline.curves import Curves
from studio.app.timeline.opening import OpenRecording
from studio.app.timeline.track_view import TrackView


class Rows(QSplitter):
    """A recording from end to end, or the part that was zoomed to.

    Args:
        theme: gives the colours.
        scrub: takes the time of a drag, and whether it has ended.
        hover: takes the time under the mouse and the object of that row, or None and "".
        choose: takes the id of an object whose row was clicked.
        name: gives what an object of an id is called.
    """

    def __init__(
        self,
        theme: Callable[[], Theme],
        *,
        scrub: Callable[[int, bool], None],
        hover: Callable[[int | None, str], None],
        choose: Callable[[str], None],
        name: Callable[[str], str],
    ) -> None:
        super().__init__(Qt.Orientation.Vertical)
        self._theme = theme
        self._shown: OpenRecording | None = None
        self.tracks = TrackView(
            theme, scrub=scrub, hover=hover, zoomed=self._on_zoom, choose=choose, name=name
        )
        self.curves = Curves()
        area = QScrollArea()
        area.setWidget(self.tracks)
        area.setWidgetResizable(True)
        area.setFrameShape(QScrollArea.Shape.NoFrame)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.verticalScrollBar().rangeChanged.connect(self._on_scroll)
        self._area = area
        self.addWidget(area)
        self.addWidget(self.curves)
        self.setStretchFactor(1, 1)
        self.setChildrenCollapsible(False)

    def show_recording(self, shown: OpenRecording | None) -> None:
        """Show a recording from end to end; None shows nothing."""
        self._shown = shown
        self.tracks.show_recording(shown)
        self.draw_curves()

    def share_height(self, height_px: int) -> None:
        """All rows are seen if the curves keep their least height."""
        rows = self.tracks.minimumHeight()
        height = height_px - self.handleWidth()
        self.setSizes([rows, max(height - rows, self.curves.minimumHeight())])

    def set_playhead(self, t_ns: int) -> None:
        """The recording's file."""
        self.tracks.set_playhead(t_ns)
        self.curves.set_playhead(t_ns)

    def redraw(self) -> None:
        """Draw all of it anew, in the colours that the theme has now."""
        self.tracks.redraw()
        self.draw_curves()

    def switch_curves(self) -> None:
        """Show yaw errors instead of position errors, or the other way round."""
        self.curves.shows_yaw = not self.curves.shows_yaw
        self.draw_curves()

    def draw_curves(self) -> None:
        """Draw the errors anew."""
        if self._shown is not None:
            self.curves.show_curves(self._shown.curves, self._theme())
            self._on_zoom()

    def _on_zoom(self) -> None:
        self.curves.show_span(self.tracks.from_ns, self.tracks.to_ns)

    def _on_scroll(self, _low: int, high: int) -> None:
        """Curves end where the rows end, whose width a scroll bar takes."""
        width = self._area.verticalScrollBar().sizeHint().width()
        self.curves.leave_right(width if high else 0)
