"""A film of the whole window, as its user sees it."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

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
        self._part = path.with_name(f"{path.name}.part")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._widget = widget
        self._container = av.open(str(self._part), "w", format="mp4")
        self._stream = self._container.add_stream("libx264", rate=FPS)
        self._stream.width, self._stream.height = widget.width() // 2 * 2, widget.height() // 2 * 2
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = {"crf": "23", "preset": "veryfast"}
        self._stream.time_base = Fraction(1, FPS)
        self._count = 0
        self._timer = QTimer(widget)
        self._timer.timeout.connect(self._take)
        self._timer.start(1000 // FPS)

    def stop(self) -> None:
        """End the film; the file is whole."""
        self._timer.stop()
        for packet in self._stream.encode(None):
            self._container.mux(packet)
        self._container.close()
        self._part.replace(self.path)

    def _take(self) -> None:
        frame = av.VideoFrame.from_ndarray(self._picture(), format="rgb24")
        frame.pts = self._count
        self._count += 1
        for packet in self._stream.encode(frame):
            self._container.mux(packet)

    def _picture(self) -> np.ndarray:
        image = self._widget.grab().toImage()
        size = (self._stream.width, self._stream.height)
        if (image.width(), image.height()) != size:
            image = image.scaled(*size)
        return pixels_of(image)


def pixels_of(image: QImage) -> np.ndarray:
    """(H, W, 3) RGB of a picture."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    return rows[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3).copy()
