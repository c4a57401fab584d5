"""All keys at a glance, over the window."""

from __future__ import annotations

from html import escape

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QFrame, QLabel, QScrollArea, QVBoxLayout, QWidget

from studio.app.model.keys import keys_of
from studio.app.model.workbench import Workbench

MOUSE = (
    ("left drag", "turn the view"),
    ("right or middle drag", "move the view"),
    ("wheel", "nearer, farther"),
    ("double-click", "turn about that place"),
    ("W A S D, Q E", "fly; Shift fast, Alt slow"),
)


class CheatSheet(QFrame):
    """Every action that has keys, by menu. Any key or click closes it."""

    def __init__(self, bench: Workbench, over: QWidget) -> None:
        super().__init__(over)
        self._bench = bench
        self._over = over
        self.setObjectName("floating")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._text = QLabel()
        self._text.setTextFormat(Qt.TextFormat.RichText)
        self._text.setAlignment(Qt.AlignmentFlag.AlignTop)
        self._text.setMargin(18)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setWidget(self._text)
        area.setFrameShape(QFrame.Shape.NoFrame)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(area)
        self.hide()

    def open(self) -> None:
        """Show the keys as they are now."""
        groups: dict[str, list[tuple[str, str]]] = {"Mouse and flight": list(MOUSE)}
        for action in self._bench.actions:
            keys = keys_of(action, self._bench.settings)
            if keys:
                groups.setdefault(action.group, []).append((keys, action.title))
        columns: list[str] = ["", "", ""]
        for name, rows in groups.items():
            shortest = min(range(3), key=lambda i: columns[i].count("<tr>"))
            lines = "".join(
                f"<tr><td><b>{escape(keys)}</b>&nbsp;&nbsp;</td><td>{escape(title)}</td></tr>"
                for keys, title in rows
            )
            columns[shortest] += f"<h3>{escape(name)}</h3><table cellspacing=3>{lines}</table>"
        cells = "".join(
            f"<td valign=top>{column}</td><td>&nbsp;&nbsp;&nbsp;</td>" for column in columns
        )
        end = "<p>Any key or click closes this. Keys are changed in the dock Keys (Ctrl+6).</p>"
        self._text.setText(f"<table><tr>{cells}</tr></table>{end}")
        margin = 40
        width = min(self._over.width() - 2 * margin, self._text.sizeHint().width() + 40)
        height = min(self._over.height() - 2 * margin, self._text.sizeHint().height() + 10)
        self.setGeometry((self._over.width() - width) // 2, margin, width, height)
        self.show()
        self.raise_()
        self.setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """See Qt."""
        event.accept()
        self.hide()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        event.accept()
        self.hide()
