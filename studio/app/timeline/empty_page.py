"""What the timeline shows while no recording is open: what it is for, and how to get one."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from studio.app.model.workbench import Workbench

WORDS = (
    "Here a session is looked at again, instant by instant. Rehearse this room, or drop a "
    "recording (.mcap) or the folder of a rehearsal onto the window."
)
WAYS = (("▶  Rehearse this room", "session.rehearse"), ("Open a recording …", "timeline.open"))
"""A button's words, and its action."""


class EmptyPage(QWidget):
    """Words and two buttons.

    Args:
        bench: whose actions the buttons do.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        words = QLabel(WORDS)
        words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        words.setWordWrap(True)
        words.setObjectName("faint")
        row = QHBoxLayout()
        row.addStretch(1)
        for title, action_id in WAYS:
            button = QPushButton(title)
            button.clicked.connect(partial(_clicked, bench, action_id))
            row.addWidget(button)
        row.addStretch(1)
        column = QVBoxLayout(self)
        column.addStretch(1)
        column.addWidget(words)
        column.addLayout(row)
        column.addStretch(1)


def _clicked(bench: Workbench, action_id: str, _checked: bool = False) -> None:
    bench.do(action_id)
