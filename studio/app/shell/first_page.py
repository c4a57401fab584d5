"""First page over the view: what the studio is, and the few ways to begin."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLayout,
    QPushButton,
    QScrollArea,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.actions import Choice
from studio.app.model.documents.recent import recent_choices
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.theme import POINT_SIZE

EDGE_PX = 12
"""Between the card and the edges of what it stands over."""

NEVER_PX = 2**24 - 1
"""A height that no arrangement has, pixels: the largest that Qt gives a widget."""

WIDTH_PX = 520
"""Width of the card at text size 1, in pixels: lines of some sixty letters, read without effort. It
grows with the text."""

RECENT = 2
"""Of each kind, what was opened lately: the card stays small."""

WAYS = (
    (
        "▶  Rehearse this room",
        "session.rehearse",
        "people move, the tracker follows; takes a few minutes",
    ),
    ("Change what happens", "dock.scenario", "people, paths and faults, on a plan of the floor"),
    (
        "Bring your own room",
        "dock.preparation",
        "drop a video, photos or a splat file anywhere here",
    ),
    ("All keys", "help.keys", "or press Ctrl+K and type what you want"),
)


class WayRows(QWidget):
    """The ways to begin: a button each, its note beside it or below it, whichever is lower."""

    def __init__(self, choose: Callable[[str], None]) -> None:
        super().__init__()
        self._rows: list[tuple[QPushButton, QLabel]] = []
        self._is_beside: bool | None = None
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(8)
        for row, (label, action_id, hint) in enumerate(WAYS):
            button = QPushButton(label)
            button.setDefault(row == 0)
            button.clicked.connect(lambda _=False, chosen=action_id: choose(chosen))
            note = QLabel(hint)
            note.setObjectName("faint")
            note.setWordWrap(True)
            self._rows.append((button, note))
        self._arrange(is_beside=True)

    def fit(self, width_px: int) -> None:
        """Arrange the notes for a width, in pixels."""
        buttons = max(button.sizeHint().width() for button, _ in self._rows)
        beside = width_px - buttons - self._grid.horizontalSpacing()
        self._arrange(is_beside=self._height(beside, True) <= self._height(width_px, False))

    def _height(self, note_px: int, is_beside: bool) -> int:
        """Return the height of all rows for notes of a width, px. No word of a note is parted."""
        if is_beside and any(note.minimumSizeHint().width() > note_px for _, note in self._rows):
            return NEVER_PX
        gap, total = self._grid.verticalSpacing(), 0
        for button, note in self._rows:
            heights = (button.sizeHint().height(), note.heightForWidth(note_px))
            total += gap + (max(heights) if is_beside else gap + sum(heights))
        return total

    def _arrange(self, *, is_beside: bool) -> None:
        if is_beside == self._is_beside:
            return
        self._is_beside = is_beside
        for row, (button, note) in enumerate(self._rows):
            self._grid.removeWidget(button)
            self._grid.removeWidget(note)
            if is_beside:
                self._grid.addWidget(button, row, 0)
                self._grid.addWidget(note, row, 1)
            else:
                self._grid.addWidget(button, 2 * row, 0, 1, 2)
                self._grid.addWidget(note, 2 * row + 1, 0, 1, 2)
        self._grid.setColumnStretch(1, 1)


class RecentRows(QWidget):
    """Buttons of what was opened lately; nothing at all where nothing was."""

    def __init__(self, choose: Callable[[str], None]) -> None:
        super().__init__()
        self.buttons: list[QPushButton] = []
        self._choose = choose
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 4, 0, 0)
        self._column.setSpacing(4)

    def add(self, choice: Choice) -> None:
        """Add one, below the others."""
        if not self.buttons:
            words = QLabel("Opened lately")
            words.setObjectName("faint")
            self._column.addWidget(words)
        button = QPushButton(choice.title)
        path = choice.values["path"]
        button.clicked.connect(lambda: self._choose(path))
        self._column.addWidget(button, alignment=Qt.AlignmentFlag.AlignLeft)
        self.buttons.append(button)


class FirstPage(QFrame):
    """A card over the lower left of the view. It goes with the first action, and for good.

    Title and ✕ always stay; where the words are higher than the view, they scroll below them.
    """

    def __init__(self, bench: Workbench, over: QWidget) -> None:
        super().__init__(over)
        self._bench = bench
        self._over = over
        self.setObjectName("floating")
        title = QLabel("<h2>A live copy of a room</h2>")
        title.setWordWrap(True)
        text = QLabel(
            "This is a scan of a room with its movable objects. One 360° camera watches the real "
            "room, and the objects here follow it. Without a camera, everything is simulated."
        )
        text.setWordWrap(True)
        self._ways = WayRows(self._do)
        close = QToolButton()
        close.setText("✕")
        close.setToolTip("Close; H shows all keys, Ctrl+K finds any command")
        close.setAccessibleName("Close")
        close.clicked.connect(self.leave)
        self._top = QHBoxLayout()
        self._top.setContentsMargins(0, 0, 6, 0)
        self._top.addWidget(title, 1)
        self._top.addWidget(close, alignment=Qt.AlignmentFlag.AlignTop)
        words = QWidget()
        self._words = QVBoxLayout(words)
        self._words.setContentsMargins(0, 0, 6, 0)  # the bar does not touch them
        self._words.setSpacing(8)
        self._words.addWidget(text)
        self._words.addWidget(self._ways)
        self.recent = RecentRows(self._open)
        for choice in recent_choices(bench.settings, RECENT):
            self.recent.add(choice)
        if self.recent.buttons:
            self._words.addWidget(self.recent)
        self._scrolled = QScrollArea()
        self._scrolled.setObjectName("clear")
        self._scrolled.setFrameShape(QFrame.Shape.NoFrame)
        self._scrolled.setWidgetResizable(True)
        self._scrolled.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # its buttons have it
        self._scrolled.setWidget(words)
        layout = self._layout = QVBoxLayout(self)
        layout.setContentsMargins(18, 12, 6, 16)
        layout.setSpacing(8)
        layout.addLayout(self._top)
        layout.addWidget(self._scrolled, 1)
        over.installEventFilter(self)
        bench.listen(Topic.SESSION, self._leave_if_begun)
        bench.listen(Topic.RECORDING, self._leave_if_begun)

    def begin(self) -> None:
        """Show it in its place."""
        self.show()
        self.place()

    def event(self, event: QEvent) -> bool:
        """See Qt: its words have another size, since their font has."""
        is_done = super().event(event)
        if event.type() == QEvent.Type.LayoutRequest and not self.isHidden():
            self.place()
        return is_done

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: what it stands over has another size."""
        # Also while nothing is shown yet: the window is laid out before it is seen.
        if watched is self._over and event.type() == QEvent.Type.Resize and not self.isHidden():
            self.place()
        return False

    def place(self) -> None:
        """Stand in the lower left of what it covers, as large as its words where there is room."""
        over = self._over
        wanted = round(WIDTH_PX * self.font().pointSizeF() / POINT_SIZE)
        width = min(wanted, over.width() - 2 * EDGE_PX)
        most = over.height() - 2 * EDGE_PX
        height = self._height(width)
        if height > most:  # the bar takes its width from the words
            self._height(width - self._scrolled.verticalScrollBar().sizeHint().width())
            height = most
        self.setGeometry(EDGE_PX, over.height() - height - EDGE_PX, width, height)

    def _height(self, width: int) -> int:
        """Arrange the words for a card so wide, and say how high it would be; both in pixels."""
        edge = self._layout.contentsMargins()
        frame = self.size() - self.contentsRect().size()
        inner = width - frame.width() - edge.left() - edge.right()
        self._ways.fit(inner - self._words.contentsMargins().right())
        parts = (_height_for(self._top, inner), _height_for(self._words, inner))
        return sum(parts) + self._layout.spacing() + edge.top() + edge.bottom() + frame.height()

    def leave(self) -> None:
        """Close it, and remember that it was seen."""
        self.hide()
        self._bench.stop_listening(self._leave_if_begun)
        self._bench.set(has_started=True)

    def _leave_if_begun(self) -> None:
        """Whoever plays or looks at something has begun, by whatever way."""
        session = self._bench.session
        is_playing = session is not None and session.is_playing
        if self.isVisible() and (is_playing or self._bench.recording is not None):
            self.leave()

    def _open(self, path: str) -> None:
        self.leave()
        self._bench.do("file.open_recent", path=path)

    def _do(self, action_id: str) -> None:
        self.leave()
        self._bench.do(action_id)


def _height_for(layout: QLayout, width: int) -> int:
    layout.invalidate()
    depends = layout.hasHeightForWidth()
    return layout.heightForWidth(width) if depends else layout.sizeHint().height()
