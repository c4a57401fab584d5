"""A hand that presses what a person sees in the window, by real mouse events, and counts.

What nobody could see or press is a dead end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QDialogButtonBox,
    QFileDialog,
    QLineEdit,
    QMenu,
    QTabBar,
    QWidget,
)

from benchmarks.studio.shown import Wait

LEFT = Qt.MouseButton.LeftButton


class DeadEndError(AssertionError):
    """The next press of a stranger is impossible: nothing there, out of sight or disabled."""


@dataclass
class Hand:
    """Presses what a person sees in a window, and counts.

    Attributes:
        window: the studio's.
        wait: handles events until something is so, see `shown_window`.
        clicks: presses of a mouse button; a drag is one.
    """

    window: Any
    wait: Wait
    clicks: int = 0

    def press(self, widget: QWidget, at: QPoint | None = None) -> None:
        """Click a widget, in its middle unless a place is given."""
        place = self._seen(widget, at)
        self.clicks += 1
        QTest.mouseClick(widget, LEFT, Qt.KeyboardModifier.NoModifier, place)

    def drag(self, widget: QWidget, start: QPoint, end: QPoint) -> None:
        """Drag from a place of a widget to another."""
        self._seen(widget, start)
        self.clicks += 1
        QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.NoModifier, start)
        for share in (0.3, 0.6, 1.0):
            QTest.mouseMove(widget, start + (end - start) * share)
        QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.NoModifier, end)

    def button(self, words: str, within: QWidget | None = None) -> None:
        """Click the button with these words, once it can be pressed."""
        root = within or self.window
        self._await(lambda: self._button(root, words) is not None, f"no button {words!r}")
        found = self._button(root, words)
        assert found is not None
        self.press(found)

    def menu(self, *titles: str) -> None:
        """Click through the menus of the menu bar."""
        bar, menu = self.window.menuBar(), None
        kept: list[QAction] = []  # menus are forgotten with the actions that they were asked of
        for title in titles:
            owner = bar if menu is None else menu
            action = next((a for a in owner.actions() if _plain(a.text()) == title), None)
            kept += [] if action is None else [action]
            if action is None or not action.isEnabled():
                raise DeadEndError(f"no menu line {title!r} that can be chosen")
            inner = action.menu()
            menu = inner if isinstance(inner, QMenu) else None
            self.press(owner, owner.actionGeometry(action).center())
            if menu is not None:
                self._await(menu.isVisible, f"the menu {title!r} does not open")

    def tab(self, title: str) -> None:
        """Click a tab: a dock's, or of a page inside a dock."""
        for dock in self.window.docks.values():
            if dock.windowTitle() == title:
                self.press(dock.tabWidget())
                return
        for bar in self.window.findChildren(QTabBar):
            for place in range(bar.count()):
                if bar.isVisible() and _plain(bar.tabText(place)) == title:
                    self.press(bar, bar.tabRect(place).center())
                    return
        raise DeadEndError(f"no tab {title!r}")

    def type(self, widget: QWidget, text: str) -> None:
        """Click into a field, and type instead of what it holds."""
        self.press(widget)
        QTest.keyClick(widget, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClicks(widget, text)
        QTest.keyClick(widget, Qt.Key.Key_Tab)

    def will_choose(self, path: Path, tries: int = 500) -> None:
        """Choose a path in the file dialog that the next click opens."""
        dialog = QApplication.activeModalWidget()
        if not isinstance(dialog, QFileDialog):
            if tries:
                QTimer.singleShot(20, lambda: self.will_choose(path, tries - 1))
            return
        name = dialog.findChild(QLineEdit, "fileNameEdit")
        assert isinstance(name, QLineEdit)
        name.setText(str(path))
        box = dialog.findChild(QDialogButtonBox)
        assert isinstance(box, QDialogButtonBox)
        self.press(box.buttons()[0])
        if dialog.isVisible():
            dialog.reject()  # the task ends, and does not wait for ever

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for what a task is to come to."""
        self._await(condition, f"{what}: did not come about; the window says {self.window.line!r}")

    def _await(self, condition: Callable[[], bool], words: str) -> None:
        try:
            self.wait(condition)
        except (TimeoutError, AssertionError) as error:
            raise DeadEndError(words) from error

    def _seen(self, widget: QWidget, at: QPoint | None) -> QPoint:
        place = widget.rect().center() if at is None else at
        if not widget.isVisible() or not widget.visibleRegion().contains(place):
            raise DeadEndError(f"nobody can see {_words(widget)}")
        if not widget.isEnabled():
            raise DeadEndError(f"{_words(widget)} cannot be pressed")
        return place

    def _button(self, root: QWidget, words: str) -> QAbstractButton | None:
        found = (b for b in root.findChildren(QAbstractButton) if words in _plain(b.text()))
        return next((b for b in found if b.isVisible() and b.isEnabled()), None)


def _plain(text: str) -> str:
    return text.replace("&", "")


def _words(widget: QWidget) -> str:
    text = widget.text() if isinstance(widget, QAbstractButton) else widget.accessibleName()
    return repr(text or type(widget).__name__)
