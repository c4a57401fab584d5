"""The question before a session is shared: where to, and what of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

PARTS: Mapping[str, str] = {
    "viewer": "Viewer: the room in three dimensions, one file for any browser, at most 25 MB",
    "film": "Film (MP4)",
    "sheet": "Session sheet: one page with the figures and what happened",
    "archive": "Archive: the recording, too, to repeat or to check it",
}
"""Words for each part, by its name in `studio.handover.share.Part`."""


class ShareDialog(QDialog):
    """Place and content.

    Args:
        parent: the window.
        folder: where it goes unless another place is chosen; it is made.
        size_mb: of the recording, which the archive holds.
        share: takes the folder and the parts.
    """

    def __init__(
        self,
        parent: QWidget,
        folder: Path,
        *,
        size_mb: float,
        share: Callable[[Path, Sequence[str]], object],
    ) -> None:
        super().__init__(parent)
        self._share = share
        self.setWindowTitle("Share")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowModality(Qt.WindowModality.WindowModal)
        self.place = QLineEdit(str(folder))
        self.place.setAccessibleName("Folder")
        self.place.setMinimumWidth(420)
        self.place.textChanged.connect(self._show_possible)
        self.browse = QPushButton("Browse …")
        self.browse.clicked.connect(self._ask_place)
        self.parts: dict[str, QCheckBox] = {}
        layout = QVBoxLayout(self)
        layout.addWidget(QLabel("New folder"))
        row = QHBoxLayout()
        row.addWidget(self.place, 1)
        row.addWidget(self.browse)
        layout.addLayout(row)
        layout.addSpacing(8)
        for name, words in PARTS.items():
            more = f" ({size_mb:.0f} MB and more)" if name == "archive" else ""
            box = QCheckBox(words + more)
            box.setChecked(True)
            box.toggled.connect(self._show_possible)
            # As wide as its words: a click beside them would do nothing.
            box.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
            self.parts[name] = box
            layout.addWidget(box)
        layout.addSpacing(8)
        self.buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        self.make = self.buttons.addButton("Share", QDialogButtonBox.ButtonRole.AcceptRole)
        self.buttons.accepted.connect(self._accept)
        self.buttons.rejected.connect(self.reject)
        layout.addWidget(self.buttons)

    def _chosen(self) -> list[str]:
        return [name for name, box in self.parts.items() if box.isChecked()]

    def _show_possible(self) -> None:
        self.make.setEnabled(bool(self._chosen()) and bool(self.place.text().strip()))

    def _ask_place(self) -> None:
        before = Path(self.place.text())
        chosen = QFileDialog.getExistingDirectory(self, "Share in a folder in", str(before.parent))
        if chosen:
            self.place.setText(str(Path(chosen) / before.name))

    def _accept(self) -> None:
        folder, parts = Path(self.place.text().strip()), self._chosen()
        self.accept()
        self._share(folder, parts)


def ask_share(
    window: QWidget, folder: Path, size_mb: float, share: Callable[[Path, Sequence[str]], object]
) -> None:
    """Ask over a window, which lives on meanwhile; see `ShareDialog`."""
    ShareDialog(window, folder, size_mb=size_mb, share=share).open()
