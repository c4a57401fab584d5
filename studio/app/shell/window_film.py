"""A film of the whole window, as its user sees it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from studio.reports.mp4_file import Mp4File

FPS = 10
"""Frames a second: an interface moves little, and the session shares the processor."""


class WindowFilm:
    """Writes pictures of a widget into an MP4 until it is stopped.

    Args:
        widget: what is filmed.
        path: the film; it is called `.part` until it is whole.

    Raises:
        OSError: the file cannot be made.
    """

    def __init__(self, widget: QWidget, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._widget = widget
        self._size = widget.width() // 2 * 2, widget.height() // 2 * 2
        self._file = Mp4File(path, FPS, crf=23).__enter__()
        self._timer = QTimer(widget)
        self._timer.timeout.connect(self._take)
        self._timer.start(1000 // FPS)

    def stop(self) -> None:
        """End the film; the file is whole."""
        self._timer.stop()
        self._file.__exit__(None, None, None)

    def _take(self) -> None:
        self._file.add(self._picture())

    def _picture(self) -> np.ndarray:
        image = self._widget.grab().toImage()
        size = self._size
        if (image.width(), image.height()) != size:
            image = image.scaled(*size)
        return pixels_of(image)


def pixels_of(image: QImage) -> np.ndarray:
    """(H, W, 3) RGB of a picture."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    return rows[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3).copy()
