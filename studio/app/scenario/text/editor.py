"""The scenario's text, coloured as TOML, with the line that is wrong marked."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QRegularExpression, QTimer
from PySide6.QtGui import (
    QColor,
    QSyntaxHighlighter,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
    QTextFormat,
)
from PySide6.QtWidgets import QPlainTextEdit, QTextEdit

from studio.app.scenario.colours import theme_of
from studio.app.shell.theme import fixed_font

TYPING_MS = 400
"""After the last key before what was typed is read."""


class Highlighter(QSyntaxHighlighter):
    """Colours tables, keys, texts, numbers and comments."""

    def __init__(self, document: QTextDocument, widget: QPlainTextEdit) -> None:
        super().__init__(document)
        self._widget = widget

    def highlightBlock(self, text: str) -> None:
        """See Qt."""
        theme = theme_of(self._widget)
        rules = (
            (r"[+-]?\b\d[\d_.]*(e[+-]?\d+)?\b|\btrue\b|\bfalse\b", theme.warning),
            (r"[\w-]+(?=\s*=)", theme.accent),
            (r"\"(?:[^\"\\]|\\.)*\"|'[^']*'", theme.good),
            (r"^\s*\[{1,2}[\w.\- ]+\]{1,2}", theme.text),
            (r"#(?=(?:[^\"]*\"[^\"]*\")*[^\"]*$).*", theme.faint),
        )
        for pattern, colour in rules:
            words = QTextCharFormat()
            words.setForeground(QColor(colour))
            words.setFontItalic(colour == theme.faint)
            if colour == theme.text:
                words.setFontWeight(700)
            matches = QRegularExpression(pattern).globalMatch(text)
            while matches.hasNext():
                found = matches.next()
                self.setFormat(found.capturedStart(), found.capturedLength(), words)


class ScenarioText(QPlainTextEdit):
    """The text editor.

    Args:
        typed: called with all the text a moment after the last key.
    """

    def __init__(self, typed: Callable[[str], object]) -> None:
        super().__init__()
        self._typed = typed
        self.setFont(fixed_font())
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setAccessibleName("Scenario as TOML")
        self.setTabChangesFocus(True)
        self.setUndoRedoEnabled(True)
        self._colours = Highlighter(self.document(), self)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self.read_now)
        self._is_shown = False
        self.textChanged.connect(self._on_typed)

    def show_text(self, text: str, error_line: int | None) -> None:
        """Show what is in the document, unless it is being typed at this moment."""
        if not self._timer.isActive() and text != self.toPlainText():
            self._is_shown = True
            cursor_at = self.textCursor().position()
            bar = self.verticalScrollBar().value()
            self.setPlainText(text)
            cursor = self.textCursor()
            cursor.setPosition(min(cursor_at, len(text)))
            self.setTextCursor(cursor)
            self.verticalScrollBar().setValue(bar)
            self._is_shown = False
        self._mark(error_line)

    def read_now(self) -> None:
        """Take what was typed without waiting."""
        self._timer.stop()
        self._typed(self.toPlainText())

    def _on_typed(self) -> None:
        if not self._is_shown:
            self._timer.start(TYPING_MS)

    def _mark(self, line: int | None) -> None:
        if line is None:
            self.setExtraSelections([])
            return
        mark = QTextEdit.ExtraSelection()
        colour = QColor(theme_of(self).bad)
        colour.setAlpha(70)
        look = QTextCharFormat()
        look.setBackground(colour)
        look.setProperty(QTextFormat.Property.FullWidthSelection, True)
        place = QTextCursor(self.document().findBlockByNumber(line - 1))
        mark.format = look
        mark.cursor = place
        self.setExtraSelections([mark])
