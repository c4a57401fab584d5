"""The bar of tools at the left of the views."""

from __future__ import annotations

from functools import partial

import qtawesome
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QAction, QActionGroup, QPalette
from PySide6.QtWidgets import QToolBar

from studio.app.model.keys import keys_of
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.by_hand.tools import Tool

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
