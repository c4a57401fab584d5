"""Up to four views beside each other, one of them in hand; and small pictures over them."""

from __future__ import annotations

from functools import partial

import qtawesome
from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QActionGroup, QCloseEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QToolBar, QWidget

from studio.app.model.keys import keys_of
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.by_hand.tools import InHand, Tool
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.insets.insets import Insets
from studio.app.viewport.layers import Layers
from studio.app.viewport.view import TwinView
from studio.app.viewport.view_actions import add_view_actions

LOOKS = ("view.frame", "view.home")
"""Actions below the tools: what to look at."""


class ToolBar(QToolBar):
    """A button for each tool, the one in hand pressed, and two that bring things into the view.

    Args:
        bench: whose actions they do; the views' have to be there.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__("Tools")
        self._bench = bench
        self._buttons: dict[str, QAction] = {}
        self.setObjectName("view tools")
        self.setOrientation(Qt.Orientation.Vertical)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonIconOnly)
        group = QActionGroup(self)
        for tool in Tool:
            self._add(f"view.tool_{tool}").setCheckable(True)
            group.addAction(self._buttons[f"view.tool_{tool}"])
        self.addSeparator()
        for action_id in LOOKS:
            self._add(action_id)
        bench.listen(Topic.SETTINGS, self._name)
        self._name()
        self._colour()

    def show_tool(self, tool: Tool) -> None:
        """That one is in hand."""
        self._buttons[f"view.tool_{tool}"].setChecked(True)

    def button(self, action_id: str) -> QAction:
        """The function that does an action."""
        return self._buttons[action_id]

    def _add(self, action_id: str) -> QAction:
        made = self.addAction("")
        made.triggered.connect(partial(self._do, action_id))
        self._buttons[action_id] = made
        return made

    def _do(self, action_id: str, _checked: bool = False) -> None:
        self._bench.do(action_id)

    def _name(self) -> None:
        """Titles with the user's keys."""
        for action_id, made in self._buttons.items():
            action = self._bench.actions.get(action_id)
            keys = keys_of(action, self._bench.settings)
            made.setText(action.title)
            made.setToolTip(f"{action.title} ({keys})" if keys else action.title)

    def _colour(self) -> None:
        colour = self.palette().color(QPalette.ColorRole.ButtonText)
        accent = self.palette().color(QPalette.ColorRole.Accent)
        for action_id, made in self._buttons.items():
            icon = self._bench.actions.get(action_id).icon
            made.setIcon(qtawesome.icon(icon, color=colour, color_on=accent))

    def changeEvent(self, event: QEvent) -> None:
        """Draw the icons anew when the theme changes."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self._buttons:
            self._colour()

    def close(self) -> bool:
        """No longer follow the bench."""
        self._bench.stop_listening(self._name)
        return super().close()


MAX_VIEWS = 4
POLL_MS = 60
"""Between two looks at the layers that threads make, milliseconds."""


class ViewGrid(QWidget):
    """The middle of the window."""

    closing = Signal()
    """Before it ends the threads that draw."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self.bench = bench
        self.views: list[TwinView] = []
        self.is_linked = False
        self.layers = Layers(bench)
        self.drawings = Drawings()
        self._insets = Insets(bench, self, self.drawings)
        self._layout = QGridLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(2)
        self.active: TwinView
        self._covered_by: QWidget | None = None
        add_view_actions(self)
        self.tools = ToolBar(bench)
        self._layout.addWidget(self.tools, 0, 0, MAX_VIEWS // 2, 1)
        self.set_count(1)
        bench.share(self)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        self._timer.start(POLL_MS)

    def _poll(self) -> None:
        problem = self.drawings.problem()
        if problem is not None:
            self.bench.say("warning", problem)
        if self.layers.poll():
            for view in self.views:
                view.redraw()

    @property
    def insets(self) -> Insets:
        """The small pictures in the corner."""
        return self._insets

    def add_foot(self, widget: QWidget) -> None:
        """Put something below all views."""
        self._layout.addWidget(widget, MAX_VIEWS, 0, 1, 3)

    def cover(self, widget: QWidget) -> None:
        """Show something in the place of all views, until it is taken away."""
        if widget is self._covered_by:
            return
        if self._covered_by is not None:
            self._layout.removeWidget(self._covered_by)
            self._covered_by.hide()
        self._covered_by = widget
        self._layout.addWidget(widget, 0, 0, MAX_VIEWS, 3)
        widget.show()
        self._show_views()

    def uncover(self, widget: QWidget) -> None:
        """Show the views again if that is what has their place."""
        if widget is self._covered_by:
            self._layout.removeWidget(widget)
            self._covered_by = None
            self._show_views()

    def _show_views(self) -> None:
        is_covered = self._covered_by is not None
        for view in self.views:
            view.cover(is_covered)
        self.tools.setVisible(not is_covered)
        self.insets.cover(is_covered)

    def set_count(self, count: int) -> None:
        """Show so many views.

        Raises:
            ValueError: more than `MAX_VIEWS`, or none.
        """
        if not 1 <= count <= MAX_VIEWS:
            raise ValueError(f"count = {count}, wanted 1 to {MAX_VIEWS} views")
        while len(self.views) > count:
            gone = self.views.pop()
            self._layout.removeWidget(gone)
            gone.close()
            gone.deleteLater()
        while len(self.views) < count:
            view = TwinView(
                self.bench,
                layers=self.layers,
                drawings=self.drawings,
                finished=self._finished,
            )
            view.installEventFilter(self)
            view.tool_taken.connect(self._all_take)
            if self.views and self.views[0].viewer is not None:
                view.set_viewer(self.views[0].viewer)
            self.views.append(view)
        for place, view in enumerate(self.views):
            self._layout.addWidget(view, place // 2, 1 + place % 2)
        self.active = self.views[0]
        self._show_views()
        self.take(self.active.hand.tool)
        self.insets.place()

    def take(self, tool: Tool) -> None:
        """Take a tool in hand, in all views."""
        self.active.take(tool)

    def _all_take(self, tool: Tool) -> None:
        self.tools.show_tool(tool)
        for view in self.views:
            if view.hand.tool is not tool:
                view.take(tool)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: the view that is touched is the one in hand; linked views follow it."""
        kind = event.type()
        if isinstance(watched, TwinView):
            if kind in (QEvent.Type.FocusIn, QEvent.Type.MouseButtonPress):
                self.active = watched
            followed = (QEvent.Type.MouseMove, QEvent.Type.Wheel, QEvent.Type.KeyRelease)
            if self.is_linked and kind in followed and watched.viewer is not None:
                for view in self.views:
                    if view is not watched and view.viewer != watched.viewer:
                        view.set_viewer(watched.viewer)
        return False

    def _finished(self, hand: InHand) -> InHand | None:
        """A tool has what it needs: what it makes is an action, so that scripts have it too.

        Returns:
            What stays in hand: of four corners that are no surface, all but the last.
        """
        places = [[round(float(v), 4) for v in place] for place in hand.places]
        if hand.tool is Tool.DRAW and len(places) > 1:
            self.bench.do("twin.annotate", points=places)
        elif hand.tool is Tool.SURFACE:
            try:
                self.bench.perform("twin.add_surface", corners=places)
            except ValueError as error:
                kept = hand.without_last()
                again = "click the last corner again" if kept.places else "click four corners"
                self.bench.say("error", f"{error}; {again}, Backspace takes back one more")
                return kept
        elif hand.tool is Tool.MEASURE and len(places) > 1:
            from studio.app.viewport.view_overlay import measure_text

            self.bench.say("info", f"measured {measure_text(hand.places)}")
        return None

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self.insets.place()

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the threads that draw."""
        self.closing.emit()
        self._covered_by = None
        self._timer.stop()
        self.layers.close()
        self.insets.close()
        self.tools.close()
        for view in self.views:
            view.close()
        self.drawings.close()
        event.accept()
