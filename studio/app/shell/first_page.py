"""What a new user sees over the view: what this is, and the few ways to begin."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from studio.app.model.workbench import Workbench

WAYS = (
    (
        "▶  Rehearse this room",
        "session.rehearse",
        "people move, the tracker follows; half a minute",
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
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.setAutoFillBackground(True)
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
            note.setWordWrap(True)
            grid.addWidget(button, row, 0)
            grid.addWidget(note, row, 1)
        grid.setColumnStretch(1, 1)
        close = QPushButton("Close")
        close.clicked.connect(self.leave)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(18, 14, 18, 14)
        layout.setSpacing(10)
        layout.addWidget(title)
        layout.addWidget(text)
        layout.addLayout(grid)
        layout.addWidget(close, alignment=Qt.AlignmentFlag.AlignRight)

    def place(self) -> None:
        """Stand in the lower left of what it covers."""
        over = self._over
        width = min(520, over.width() - 32)
        height = (
            self.heightForWidth(width) if self.hasHeightForWidth() else self.sizeHint().height()
        )
        height = min(max(height, self.minimumSizeHint().height()), over.height() - 32)
        self.setGeometry(16, over.height() - height - 16, width, height)

    def leave(self) -> None:
        """Close it, and remember that it was seen."""
        self.hide()
        self._bench.set(has_started=True)

    def _do(self, action_id: str) -> None:
        self.leave()
        self._bench.do(action_id)


def scene_title(scene: str) -> str:
    """How a scene is called in the title of the window and in menus."""
    return Path(scene).name or scene
