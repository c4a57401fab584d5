"""The command palette: every action by typing a part of its name."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QEvent, QModelIndex, QObject, QPersistentModelIndex, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPalette
from PySide6.QtWidgets import (
    QFrame,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
)
from PySide6.QtWidgets import QWidget as Widget

from studio.app.model.actions import Action, matching
from studio.app.model.keys import keys_of
from studio.app.model.workbench import Workbench

WIDTH_PX, ROWS = 620, 11
KEYS = int(Qt.ItemDataRole.UserRole) + 1
"""Role of an item's keys."""


class KeysAtTheRight(QStyledItemDelegate):
    """Draws an item as usual, and its keys at the right end of its line."""

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        """See Qt."""
        super().paint(painter, option, index)
        keys = index.data(KEYS)
        if not keys:
            return
        state: Any = option.state  # pyright: ignore[reportAttributeAccessIssue]
        area: Any = option.rect  # pyright: ignore[reportAttributeAccessIssue]
        is_chosen = bool(state & QStyle.StateFlag.State_Selected)
        is_on = bool(state & QStyle.StateFlag.State_Enabled)
        colours: Any = option.palette  # pyright: ignore[reportAttributeAccessIssue]
        group = QPalette.ColorGroup.Active if is_on else QPalette.ColorGroup.Disabled
        role = QPalette.ColorRole
        painter.setPen(
            colours.color(group, role.HighlightedText if is_chosen else role.PlaceholderText)
        )
        painter.drawText(area.adjusted(0, 0, -10, 0), _AT_THE_RIGHT, str(keys))


_AT_THE_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class CommandPalette(QFrame):
    """Floats over the window: type, choose with the arrows, Enter does it, Escape leaves.

    An action that needs arguments is put into the field as the line of a script, to be completed.
    """

    def __init__(self, bench: Workbench, over: Widget) -> None:
        super().__init__(over)
        self._bench = bench
        self._over = over
        self.setObjectName("floating")
        self.field = QLineEdit()
        self.field.setPlaceholderText("Type what you want to do …")
        self.field.setAccessibleName("command")
        self.list = QListWidget()
        self.list.setItemDelegate(KeysAtTheRight(self.list))
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setAccessibleName("commands found")
        self._none = QLabel("No command has that in its name")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(10, 10, 10, 10)
        for widget in (self.field, self.list, self._none):
            layout.addWidget(widget)
        self.field.textChanged.connect(self._fill)
        self.field.installEventFilter(self)
        self.list.itemClicked.connect(self._choose)
        self.hide()

    def open(self) -> None:
        """Show it, empty."""
        width = min(WIDTH_PX, self._over.width() - 40)
        row = self.list.sizeHintForRow(0) if self.list.count() else 24
        self.setGeometry((self._over.width() - width) // 2, 60, width, 80 + ROWS * max(row, 24))
        self.field.clear()
        self._fill("")
        self.show()
        self.raise_()
        self.field.setFocus()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: keys of the field that belong to the list."""
        if (
            watched is self.field
            and isinstance(event, QKeyEvent)
            and event.type() == QEvent.Type.KeyPress
        ):
            key = event.key()
            if key == Qt.Key.Key_Escape:
                self.hide()
                return True
            if key in (Qt.Key.Key_Down, Qt.Key.Key_Up):
                step = 1 if key == Qt.Key.Key_Down else -1
                self.list.setCurrentRow((self.list.currentRow() + step) % max(self.list.count(), 1))
                return True
            if key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self._enter()
                return True
        if watched is self.field and event.type() == QEvent.Type.FocusOut:
            self.hide()
        return super().eventFilter(watched, event)

    def _fill(self, typed: str) -> None:
        self.list.clear()
        if "=" in typed:
            self._none.setText("Enter does this line")
            self._none.show()
            return
        for action in matching(self._bench.actions, typed):
            keys = keys_of(action, self._bench.settings)
            item = QListWidgetItem(f"{action.group}: {action.title}")
            item.setData(Qt.ItemDataRole.UserRole, action.id)
            item.setData(KEYS, keys)
            item.setToolTip(action.hint)
            if not action.is_available:
                item.setFlags(item.flags() & ~Qt.ItemFlag.ItemIsEnabled)
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        self._none.setText("No command has that in its name")
        self._none.setVisible(self.list.count() == 0)

    def _enter(self) -> None:
        typed = self.field.text().strip()
        if "=" in typed:
            self.hide()
            self._bench.do("script.line", line=typed)
        elif (item := self.list.currentItem()) is not None:
            self._choose(item)

    def _choose(self, item: QListWidgetItem) -> None:
        action: Action = self._bench.actions.get(item.data(Qt.ItemDataRole.UserRole))
        if action.arguments and not _runs_bare(action):
            self.field.setText(f"{action.id} " + " ".join(f"{name}=" for name in action.arguments))
            return
        self.hide()
        self._bench.do(action.id)


def _runs_bare(action: Action) -> bool:
    """Whether every argument of an action has a default."""
    import inspect

    parameters = inspect.signature(action.run).parameters.values()
    return all(
        p.default is not p.empty or p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL) for p in parameters
    )
