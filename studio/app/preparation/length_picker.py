"""A known length: both ends are clicked in photos, and its metres typed."""

from __future__ import annotations

from pathlib import Path

import cv2
from PySide6.QtGui import QImage
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from scenes.prepare.footage.picture_files import read_upright
from studio.app.model.documents.dropped import PICTURES
from studio.app.preparation.photo_marker import MarkTool, PhotoMarker
from studio.app.preparation.preparation_job import Pick

SHOWN_PX = 1600
"""Longer side at which photos are shown: larger ones take too long to read; marks keep the pixels
of the photo itself."""
ENDS = {"End a": "a", "End b": "b"}
WANTED = 2
"""Photos in which each end is clicked at least."""


class LengthPicker(QWidget):
    """Photos of a folder, one end or the other, and the metres between them."""

    def __init__(self) -> None:
        super().__init__()
        self.photos, self.end, self.metres = QComboBox(), QComboBox(), QDoubleSpinBox()
        self.photos.setAccessibleName("Photo")
        self.end.addItems(list(ENDS))
        self.metres.setRange(0.0, 100.0)
        self.metres.setDecimals(3)
        self.metres.setSuffix(" m")
        self.metres.setSpecialValueText("no length")
        self.marker, self.line = PhotoMarker(), QLabel()
        self.marker.tool = MarkTool.CLICKS
        self.line.setWordWrap(True)
        self._folder: Path | None = None
        self._scale = 1.0
        self._found: dict[tuple[str, str], tuple[float, float]] = {}
        row = QHBoxLayout()
        row.addWidget(self.photos, 1)
        row.addWidget(self.end)
        row.addWidget(self.metres)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(row)
        layout.addWidget(self.marker)
        layout.addWidget(self.line)
        self.photos.currentTextChanged.connect(self._show)
        self.end.currentTextChanged.connect(self._show_marks)
        self.marker.changed.connect(self._take)

    @property
    def length_m(self) -> float | None:
        """The length, or None."""
        return self.metres.value() or None

    def picks(self) -> dict[str, tuple[Pick, ...]]:
        """Clicks on both ends, in pixels of the photos."""
        return {
            end: tuple((photo, *at) for (which, photo), at in self._found.items() if which == end)
            for end in ENDS.values()
        }

    def show_photos(self, source: Path) -> None:
        """Offer the photos of a folder; nothing of anything else."""
        self._found.clear()
        self._folder = source if source.is_dir() else None
        files = sorted(source.iterdir()) if source.is_dir() else []
        names = [file.name for file in files if file.suffix.lower() in PICTURES]
        self.photos.clear()
        self.photos.addItems(names)
        self.setVisible(bool(names))
        self._say()

    def _show(self, name: str) -> None:
        if self._folder is None or not name:
            self.marker.show_image(QImage())
            return
        picture = read_upright(self._folder / name)  # what Qt cannot read, too: HEIC
        image = QImage()
        self._scale = 1.0
        if picture is not None:
            longest = max(picture.shape[:2])
            self._scale = max(longest / SHOWN_PX, 1.0)
            height, width = (round(side / self._scale) for side in picture.shape[:2])
            shown = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
            image = QImage(shown.data, width, height, 3 * width, QImage.Format.Format_BGR888).copy()
        self.marker.hint = f"{name} cannot be shown"
        self.marker.show_image(image)
        self._show_marks()

    def _show_marks(self) -> None:
        at = self._found.get((ENDS[self.end.currentText()], self.photos.currentText()))
        points = [] if at is None else [(at[0] / self._scale, at[1] / self._scale)]
        self.marker.set_marks(None, points)

    def _take(self) -> None:
        x, y = self.marker.points[-1]
        self.marker.set_marks(None, [(x, y)])
        key = ENDS[self.end.currentText()], self.photos.currentText()
        self._found[key] = x * self._scale, y * self._scale
        self._say()

    def _say(self) -> None:
        counts = {end: len(found) for end, found in self.picks().items()}
        words = ", ".join(f"{end} in {count} of {WANTED}" for end, count in counts.items())
        self.line.setText(f"A known length: click each end in {WANTED} photos ({words})")
