"""Menus and shortcuts made of the table of actions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMainWindow, QMenu, QToolBar

from studio.app.model.actions import Action
from studio.app.model.keys import keys_of
from studio.app.model.workbench import Workbench

ORDER = (
    "File",
    "Edit",
    "View",
    "Twin",
    "Session",
    "Live",
    "Timeline",
    "Scenario",
    "Preparation",
    "Help",
)
"""Menus from the left; others follow."""

TOOLBAR = (
    "file.open",
    "file.save",
    "",
    "edit.undo",
    "edit.redo",
    "",
    "session.rehearse",
    "session.stop",
    "",
    "share.ask",
    "",
    "palette.open",
    "help.keys",
)
"""Actions of the toolbar; "" is a gap."""


class Menus:
    """Qt's actions for ours: one each, kept up to date with keys and availability.

    Args:
        bench: whose actions.
        window: whose menus and toolbar.
    """

    def __init__(self, bench: Workbench, window: QMainWindow) -> None:
        self._bench = bench
        self._window = window
        self._made: dict[str, QAction] = {}
        self._menus: dict[str, QMenu] = {}
        self._coloured: dict[QAction, str] = {}
        self.toolbar = QToolBar("Main")
        self.toolbar.setObjectName("main toolbar")
        self.toolbar.setMovable(False)
        self.toolbar.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        window.addToolBar(self.toolbar)

    def build(self) -> None:
        """Make what is missing: at the start, and after a dock or plug-in has added actions."""
        groups = [*ORDER, *(a.group for a in self._bench.actions)]
        for name in dict.fromkeys(groups):
            if name not in self._menus and any(a.group == name for a in self._bench.actions):
                self._menus[name] = self._insert_menu(name)
        for action in self._bench.actions:
            if action.id not in self._made:
                self._add(action)
        for action_id in set(self._made) - {a.id for a in self._bench.actions}:
            gone = self._made.pop(action_id)
            self._coloured.pop(gone, None)
            self._window.removeAction(gone)
            gone.deleteLater()
        self._fill_toolbar()
        self.refresh()

    def refresh(self) -> None:
        """Keys and availability as they are now."""
        for action in self._bench.actions:
            made = self._made.get(action.id)
            if made is None:
                continue
            keys = QKeySequence(keys_of(action, self._bench.settings))
            if made.shortcut() != keys:
                made.setShortcut(keys)
            if made.isEnabled() != action.is_available:
                made.setEnabled(action.is_available)
            if action.is_on is not None:
                made.setChecked(action.is_on())
            if action.says is not None and made.text() != (said := action.says()):
                made.setText(said)

    def colour(self, colour: str) -> None:
        """Draw the icons in a colour: of the theme."""
        import qtawesome  # loads fonts: not before the window is shown

        for action in self._bench.actions:
            made = self._made.get(action.id)
            if action.icon and made is not None and self._coloured.get(made) != colour:
                made.setIcon(qtawesome.icon(action.icon, color=colour))
                self._coloured[made] = colour

    def qt_action(self, action_id: str) -> QAction:
        """The one for an action."""
        return self._made[action_id]

    def menu(self, name: str) -> QMenu:
        """A menu by its title."""
        return self._menus[name]

    def _insert_menu(self, name: str) -> QMenu:
        bar = self._window.menuBar()
        if name in ORDER:
            later = [self._menus[n] for n in ORDER[ORDER.index(name) + 1 :] if n in self._menus]
        else:
            later = [self._menus["Help"]] if "Help" in self._menus else []
        menu = QMenu(f"&{name}", bar)
        menu.aboutToShow.connect(self.refresh)  # also for what changes without a word to anybody
        if later:
            bar.insertMenu(later[0].menuAction(), menu)
        else:
            bar.addMenu(menu)
        return menu

    def _add(self, action: Action) -> None:
        made = QAction(action.title, self._window)
        made.setToolTip(action.hint or action.title)
        made.setStatusTip(action.hint)
        made.setObjectName(action.id)
        made.setIconText(action.title.removesuffix(" …"))  # of its button, which keeps its width
        made.setCheckable(action.is_on is not None)
        made.triggered.connect(self._trigger(action.id))
        # Keys belong to the whole window, also where the action is in no menu.
        self._window.addAction(made)
        if action.choices is not None:
            self._add_choices(action)
        elif not action.arguments or action.keys:
            self._menus[action.group].addAction(made)
        self._made[action.id] = made

    def _add_choices(self, action: Action) -> None:
        """A menu of its own, filled whenever it is opened."""
        menu = self._menus[action.group].addMenu(action.title)
        menu.setObjectName(f"{action.id} choices")

        def fill() -> None:
            menu.clear()
            for choice in () if action.choices is None else action.choices():
                made = menu.addAction(choice.title.replace("&", "&&"))
                made.setCheckable(choice.is_on is not None)
                made.setChecked(bool(choice.is_on))
                made.setEnabled(action.is_available)
                made.triggered.connect(partial(self._choose, action.id, dict(choice.values)))

        menu.aboutToShow.connect(fill)

    def _choose(self, action_id: str, values: dict[str, Any], _checked: bool = False) -> None:
        self._bench.do(action_id, **values)

    def _trigger(self, action_id: str) -> Callable[..., None]:
        def run(_checked: bool = False) -> None:
            self._bench.do(action_id)
            self.refresh()  # Qt has turned the check mark, whatever became of it

        return partial(run)

    def _fill_toolbar(self) -> None:
        self.toolbar.clear()
        for action_id in TOOLBAR:
            if not action_id:
                self.toolbar.addSeparator()
            elif action_id in self._made:
                self.toolbar.addAction(self._made[action_id])
