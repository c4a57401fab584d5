"""Keys without Ctrl, such as F or Space: they work in the view and the timeline alone."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

VIEW = "View"
"""Id of what holds the views: the docks' library has it as a dock, too."""

WHERE = frozenset({VIEW, "timeline"})
"""Ids of the docks in which they work; what is in no dock has them, too."""

CHORDS = (
    Qt.KeyboardModifier.ControlModifier
    | Qt.KeyboardModifier.AltModifier
    | Qt.KeyboardModifier.MetaModifier
)


class SingleKeys(QObject):
    """Keeps single keys from what has the focus in a dock: there somebody types, if only nearly.

    Args:
        window: for whose life this holds.
        manager: of its docks: a click beside their fields takes the focus into them.
    """

    def __init__(self, window: QWidget, manager: Any) -> None:
        super().__init__(window)
        self._manager = manager
        for dock_id, dock in manager.dockWidgetsMap().items():
            if dock_id not in WHERE:
                dock.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        application = QApplication.instance()
        assert application is not None
        application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: who accepts the override of a shortcut gets the key itself."""
        # Every event of the program comes by: its class is known sooner than its type.
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.ShortcutOverride:
            return False
        focus = QApplication.focusWidget()
        if focus is None or not _is_single(event) or not self._keeps(focus, Qt.Key(event.key())):
            return False
        event.accept()
        return True

    def _keeps(self, focus: QWidget, key: Qt.Key) -> bool:
        """Whether a single key is for what has the focus, and no shortcut."""
        if key == Qt.Key.Key_Space and isinstance(focus, QAbstractButton):
            return True  # presses it
        docks = self._manager.dockWidgetsMap().items()
        return any(dock.isAncestorOf(focus) for name, dock in docks if name not in WHERE)


def _is_single(event: QKeyEvent) -> bool:
    is_printed = event.key() < Qt.Key.Key_Escape
    return is_printed and not event.modifiers() & CHORDS
