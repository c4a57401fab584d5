"""Page of the timeline while no recording is open: what it is for, and how to get one."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QStackedWidget, QWidget

from studio.app.model.standing import Mode
from studio.app.model.workbench import Topic, Workbench

WORDS = (
    "Here a session is looked at again, instant by instant. Rehearse this room, or drop a "
    "recording (.mcap) or the folder of a rehearsal onto the window."
)
PLAYING = "The session is being played and recorded. When it has ended, it can be looked at here."
LIVE = (
    "A live session: the dock Live says how it is doing. When it has ended, what it has recorded "
    "can be looked at here."
)
REHEARSE, STOP = "session.rehearse", "session.stop"
WAYS = (
    ("▶  Rehearse this room", REHEARSE),
    ("Open a recording …", "timeline.open"),
    ("■  Stop", STOP),
)
"""A button's words, and its action."""


class EmptyPage(QWidget):
    """Words and buttons; other ones while a session is playing.

    Args:
        bench: whose actions the buttons do.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.words = QLabel()
        self.words.setWordWrap(True)
        self.words.setObjectName("faint")
        self.buttons: dict[str, QPushButton] = {}
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 2, 12, 2)
        for title, action_id in WAYS:
            button = QPushButton(title)
            button.clicked.connect(partial(_clicked, bench, action_id))
            self.buttons[action_id] = button
            row.addWidget(button)
        row.addSpacing(8)
        row.addWidget(self.words, 1)
        bench.listen(Topic.SESSION, self._show_state)
        self._show_state()

    def _show_state(self) -> None:
        session = self._bench.session
        is_playing = session is not None and session.is_playing
        is_live = self._bench.standing.mode is Mode.LIVE
        self.words.setText(LIVE if is_live else PLAYING if is_playing else WORDS)
        for action_id, button in self.buttons.items():
            button.setVisible((action_id == STOP) == is_playing)

    def leave(self) -> None:
        """No longer follow the bench."""
        self._bench.stop_listening(self._show_state)


def _clicked(bench: Workbench, action_id: str, _checked: bool = False) -> None:
    bench.do(action_id)


class TimelinePages(QStackedWidget):
    """Pages of which the first, the empty one, may be lower than the others."""

    def __init__(self) -> None:
        super().__init__()
        self.currentChanged.connect(self.updateGeometry)

    def hasHeightForWidth(self) -> bool:
        """See Qt."""
        return self.currentIndex() != 0 and super().hasHeightForWidth()

    def minimumSizeHint(self) -> QSize:
        """See Qt."""
        is_empty = self.currentIndex() == 0
        return self.currentWidget().minimumSizeHint() if is_empty else super().minimumSizeHint()
