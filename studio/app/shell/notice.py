"""A bar over the view that says something and offers what to do. It blocks nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QWidget

from studio.app.model.workbench import Notice, Topic, Workbench
from studio.app.shell.theme import SHAPES


class NoticeBar(QFrame):
    """One sentence with buttons; each closes it."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAutoFillBackground(True)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(12, 6, 8, 6)
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextFormat(Qt.TextFormat.PlainText)  # it may hold a file's name
        self._row.addWidget(self._text, 1)
        self._buttons: list[QPushButton] = []
        self.hide()

    @property
    def text(self) -> str:
        """Its text."""
        return self._text.text()

    def offer(self, text: str, ways: Mapping[str, Callable[[], object]]) -> None:
        """Show a sentence, and a button for each way to go on; the first is the usual one."""
        for button in self._buttons:
            button.hide()  # at once: it is deleted when all else is done
            button.deleteLater()
        self._buttons = []
        self._text.setText(text)
        for label, go_on in ways.items():
            button = QPushButton(label)
            button.setDefault(not self._buttons)
            button.clicked.connect(lambda _=False, chosen=go_on: self._choose(chosen))
            self._row.addWidget(button)
            self._buttons.append(button)
        self.show()

    def follow(self, bench: Workbench) -> None:
        """Show what the bench has to say from now on, until it is closed or the room is another."""

        def show() -> None:
            if bench.notice is not None:
                self._show_notice(bench.notice)

        bench.listen(Topic.NOTICE, show)
        bench.listen(Topic.OPENED, self.hide)

    def _show_notice(self, notice: Notice) -> None:
        shape = {"info": "calm", "warning": "warning", "error": "bad"}[notice.level]
        self.offer(f"{SHAPES[shape]} {notice.text}", {**notice.ways, "Close": _do_nothing})

    def choose(self, label: str) -> None:
        """As if a button had been clicked."""
        next(button for button in self._buttons if button.text() == label).click()

    def _choose(self, go_on: Callable[[], object]) -> None:
        self.hide()
        go_on()


def _do_nothing() -> None:
    """The sentence was read."""
