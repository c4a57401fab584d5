"""The docks of a window: empty at first, filled one by one, arranged in layouts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import PySide6QtAds as ads
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QLabel, QMainWindow, QSplitter, QWidget

from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.docking.docks import CLOSED_AT_FIRST, DOCKS, Dock, make_content
from studio.app.shell.docking.layouts import AREAS, FIRST_SHARES, Layout, add_dock_again
from studio.app.shell.keys.single_keys import VIEW
from studio.app.shell.theme import Theme

NEXT_MS = 30
"""Between the contents of two docks: the window answers in the meantime."""

EMPTY_PX = 114
"""Height of its tab, its buttons and one line of words, at the system's size of text."""

RAISED_PX = 260
"""Least height with a recording, at that size of text: two rows, the curves and the legend."""

MAX_SHARE = 0.5
"""Of the window's docks: what the raised timeline takes at most."""

SLACK_PX = 2
"""A height that differs by more was chosen by hand."""

PLAY = "timeline.play"
"""The action that is available as soon as there is something to look at."""


class WindowDocks:
    """The docks around what stands in the middle.

    Args:
        window: that they are of.
        bench: what their contents are made with.
        middle: what they stand around.
        filled: called whenever one has got its content.
    """

    def __init__(
        self, window: QMainWindow, bench: Workbench, middle: QWidget, *, filled: Callable[[], None]
    ) -> None:
        self._window, self._bench, self._filled = window, bench, filled
        self._is_filling = False
        self.contents: dict[str, QWidget] = {}
        """By the dock's id."""
        self.manager = _make_manager(window)
        self.widgets: dict[str, Any] = {}
        """By id, as the docks' library has them."""
        self._make(middle)
        self._first_layout = Layout(bytes(self.manager.saveState().data()), FIRST_SHARES)
        self._timeline_height = TimelineHeight(bench, self.widgets["timeline"])

    def _make(self, middle: QWidget) -> None:
        centre = ads.CDockWidget(self.manager, VIEW)
        centre.setWidget(middle)
        centre.setFeature(ads.CDockWidget.DockWidgetFeature.NoTab, True)
        areas = {"centre": self.manager.setCentralWidget(centre)}
        for dock in DOCKS:
            widget = ads.CDockWidget(self.manager, dock.title)
            widget.setObjectName(dock.id)
            widget.setWidget(QWidget())
            widget.setMinimumSizeHintMode(
                ads.CDockWidget.eMinimumSizeHintMode.MinimumSizeHintFromDockWidget
            )
            widget.visibilityChanged.connect(lambda _=False, of=dock: self._fill_visible(of))
            if dock.side in areas:
                self.manager.addDockWidgetTabToArea(widget, areas[dock.side])
            else:
                areas[dock.side] = self.manager.addDockWidget(AREAS[dock.side], widget)
            self.widgets[dock.id] = widget
        for side in ("left", "right"):
            first = next(self.widgets[dock.id] for dock in DOCKS if dock.side == side)
            first.setAsCurrentTab()
        for dock_id in CLOSED_AT_FIRST:
            self.widgets[dock_id].toggleView(False)
        self.manager.setSplitterSizes(areas["left"], [250, 640, 490])
        self.manager.setSplitterSizes(areas["bottom"], [540, 260])

    # --- contents --------------------------------------------------------------------------------

    def begin_filling(self) -> None:
        """Make one dock's content at a time, those that are seen first."""
        self._is_filling = True
        QTimer.singleShot(0, self._window, self._fill_next)

    def stop_filling(self) -> None:
        """Make no more contents."""
        self._is_filling = False

    @property
    def are_filled(self) -> bool:
        """Whether all have their contents."""
        return len(self.contents) == len(DOCKS)

    def content(self, dock_id: str) -> QWidget:
        """Return what a dock holds; made if it was not yet."""
        self._fill(next(dock for dock in DOCKS if dock.id == dock_id))
        return self.contents[dock_id]

    def _fill_next(self) -> None:
        order = sorted(DOCKS, key=lambda dock: not self.widgets[dock.id].isVisible())
        missing = [dock for dock in order if dock.id not in self.contents]
        if missing and self._is_filling:
            self._fill(missing[0])
            QTimer.singleShot(NEXT_MS, self._window, self._fill_next)

    def _fill_visible(self, dock: Dock) -> None:
        if self._is_filling and self.widgets[dock.id].isVisible():
            self._fill(dock)

    def _fill(self, dock: Dock) -> None:
        if dock.id in self.contents:
            return
        content = make_content(dock, self._bench)
        self.contents[dock.id] = content
        before = self.widgets[dock.id].takeWidget()
        self.widgets[dock.id].setWidget(content)
        before.deleteLater()
        self._filled()

    # --- looks -----------------------------------------------------------------------------------

    def show(self, dock_id: str) -> None:
        """Bring a dock to the front of its tabs, with the keys."""
        self.widgets[dock_id].toggleView(True)
        self.widgets[dock_id].setAsCurrentTab()
        self.content(dock_id).setFocus()

    def colour(self, theme: Theme) -> None:
        """Draw the tabs in a theme's colours."""
        import qtawesome  # loads fonts: not before the window is shown

        for dock in DOCKS:
            self.widgets[dock.id].setIcon(qtawesome.icon(dock.icon, color=theme.faint))
            # The docks' library colours its tabs by itself, unreadably in a dark theme.
            for label in self.widgets[dock.id].tabWidget().findChildren(QLabel):
                label.setStyleSheet(f"color: {theme.text}")

    # --- layouts ---------------------------------------------------------------------------------

    def save_layout(self, name: str) -> None:
        """Remember the layout by a name."""
        layout = Layout.of(self.manager).text()
        self._bench.set(layouts={**self._bench.settings.layouts, name: layout})

    def load_layout(self, name: str) -> None:
        """Arrange the docks as remembered; "" as in a first window.

        Raises:
            ValueError: there is none of that name, or it is damaged.
        """
        if not name:
            self._first_layout.show(self.manager)
            self.lower_timeline()
            return
        layout = self._bench.settings.layouts.get(name)
        if layout is None:
            known = ", ".join(self._bench.settings.layouts) or "none"
            raise ValueError(f"no layout {name!r}; saved are: {known}")
        Layout.from_text(layout).show(self.manager)

    def lower_timeline(self) -> None:
        """Make the timeline low, unless there is something to look at."""
        self._timeline_height.lower()


def _make_manager(window: QMainWindow) -> Any:
    flags = ads.CDockManager.eConfigFlag
    ads.CDockManager.setConfigFlag(flags.OpaqueSplitterResize, True)
    ads.CDockManager.setConfigFlag(flags.FocusHighlighting, False)
    ads.CDockManager.setConfigFlag(flags.DockAreaHasTabsMenuButton, False)
    # The application's theme decides, also after a change of theme.
    ads.CDockManager.setConfigFlag(flags.DisableStylesheet, True)
    # A floating dock is dragged back by a title bar of the library's own: it sees no drags of
    # a window manager's.
    ads.CDockManager.setConfigFlag(flags.FloatingContainerForceQWidgetTitleBar, True)
    manager = ads.CDockManager(window)
    add_dock_again(manager)
    return manager


class TimelineHeight:
    """Lowers the empty timeline of a first layout, and raises it to its share once it is needed.

    A timeline that stands as low as it was made here is raised; any other height is the user's.

    Args:
        bench: whose sessions and recordings need it.
        dock: the timeline's, as the docks' library has it.
    """

    def __init__(self, bench: Workbench, dock: Any) -> None:
        self._bench, self._dock = bench, dock
        self._low_px = self._wanted_px
        for topic in (Topic.RECORDING, Topic.SESSION):
            bench.listen(topic, self._raise_if_needed)
        bench.listen(Topic.SETTINGS, self._follow_text)

    def lower(self) -> None:
        """Make it low, unless there is something to look at."""
        if not self._is_needed:
            self._low_px = self._wanted_px
            self._set_height(self._low_px)

    @property
    def _text_scale(self) -> float:
        return self._bench.settings.text_scale

    @property
    def _wanted_px(self) -> int:
        return round(EMPTY_PX * self._text_scale)

    @property
    def _is_needed(self) -> bool:
        actions = self._bench.actions
        can_play = PLAY in actions and actions.get(PLAY).is_available
        return can_play or self._bench.standing.is_session

    def _is_low(self) -> bool:
        splitter = self._splitter()
        return splitter is not None and abs(self._height(splitter) - self._low_px) <= SLACK_PX

    def _raise_if_needed(self) -> None:
        splitter = self._splitter()
        if splitter is not None and self._is_needed and self._is_low():
            whole_px = sum(splitter.sizes())
            wanted_px = max(FIRST_SHARES[0][1] * whole_px, RAISED_PX * self._text_scale)
            self._set_height(round(min(wanted_px, MAX_SHARE * whole_px)))

    def _follow_text(self) -> None:
        if self._low_px != self._wanted_px and self._is_low():
            self.lower()

    def _splitter(self) -> QSplitter | None:
        """The splitter that has views above and the timeline below; None elsewhere."""
        area = self._dock.dockAreaWidget()
        splitter = None if area is None else area.parentWidget()
        if not isinstance(splitter, QSplitter) or splitter.count() != 2:
            return None
        is_below = splitter.orientation() == Qt.Orientation.Vertical and splitter.widget(1) is area
        return splitter if is_below else None

    def _height(self, splitter: QSplitter) -> int:
        return splitter.sizes()[1]

    def _set_height(self, height_px: int) -> None:
        splitter = self._splitter()
        if splitter is not None:
            splitter.setSizes([sum(splitter.sizes()) - height_px, height_px])
