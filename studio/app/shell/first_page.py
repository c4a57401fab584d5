"""What a new user sees over the view: what this is, and the few ways to begin."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.workbench import Topic, Workbench

EDGE_PX = 12
"""Between the card and the edges of what it stands over."""

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


class FirstPage(QFrame):
    """A card over the lower left of the view. It goes with the first action, and for good."""

    def __init__(self, bench: Workbench, over: QWidget) -> None:
        super().__init__(over)
        self._bench = bench
        self._over = over
        self.setObjectName("floating")
        title = QLabel("<h2>A live copy of a room</h2>")
        text = QLabel(
            "This is a scan of a room with its movable objects. One 360° camera watches the real "
            "room, and the objects here follow it. Without a camera, everything is simulated."
        )
        text.setWordWrap(True)
        grid = QGridLayout()
        for row, (label, action_id, hint) in enumerate(WAYS):
            button = QPushButton(label)
            button.setDefault(row == 0)
            button.clicked.connect(lambda _=False, chosen=action_id: self._do(chosen))
            note = QLabel(hint)
            note.setObjectName("faint")
            note.setWordWrap(True)
            grid.addWidget(button, row, 0)
            grid.addWidget(note, row, 1)
        grid.setColumnStretch(1, 1)
        close = QToolButton()
        close.setText("✕")
        close.setToolTip("Close; H shows all keys, Ctrl+K finds any command")
        close.setAccessibleName("Close")
        close.clicked.connect(self.leave)
        top = QHBoxLayout()
        top.addWidget(title, 1)
        top.addWidget(close, alignment=Qt.AlignmentFlag.AlignTop)
        layout = self._layout = QVBoxLayout(self)
        layout.setContentsMargins(18, 12, 12, 16)
        # Its words are as high as its width makes them; the least width's height is no limit.
        layout.setSizeConstraint(QVBoxLayout.SizeConstraint.SetNoConstraint)
        layout.setSpacing(8)
        layout.addLayout(top)
        layout.addWidget(text)
        layout.addLayout(grid)
        over.installEventFilter(self)
        bench.listen(Topic.SESSION, self._leave_if_begun)
        bench.listen(Topic.RECORDING, self._leave_if_begun)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: what it stands over has another size."""
        # Also while nothing is shown yet: the window is laid out before it is seen.
        if watched is self._over and event.type() == QEvent.Type.Resize and not self.isHidden():
            self.place()
        return False

    def place(self) -> None:
        """Stand in the lower left of what it covers."""
        over = self._over
        width = min(520, over.width() - 2 * EDGE_PX)
        height = min(self._layout.totalHeightForWidth(width), over.height() - 2 * EDGE_PX)
        self.setGeometry(EDGE_PX, over.height() - height - EDGE_PX, width, height)

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

    def _do(self, action_id: str) -> None:
        self.leave()
        self._bench.do(action_id)


def scene_title(scene: str) -> str:
    """How a scene is called in the title of the window and in menus."""
    return Path(scene).name or scene
