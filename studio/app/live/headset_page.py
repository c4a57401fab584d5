"""The local user's HoloLens in the panel: whether it is worn, what its wearer sees, how it does."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.app.live.headset_words import Figure, figures_of, sentence_of
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.workbench import Workbench
from studio.app.shell.theme import SHAPES, THEMES

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from studio.live.hololens.worn import WornStatus
    from studio.live.live import LiveSession
    from studio.live.status import LiveStatus

WIDTH_PX, HEIGHT_PX = 256, 144
"""Size of the wearer's view, chosen: a code on a wall can be made out."""

ADDRESS_HINT = "such as 192.168.1.40, as its program shows it when it starts"
"""Text in an empty address."""


class HeadsetPage(QWidget):
    """Its address, the view of its wearer, and figures of its streams.

    Args:
        bench: for the theme.
        live: the live session.
    """

    def __init__(self, bench: Workbench, live: LiveRun) -> None:
        super().__init__()
        self._bench, self._live = bench, live
        self._shown_seq: int | None = None
        self.is_worn = QCheckBox("The local user wears a HoloLens")
        self.is_worn.toggled.connect(self._chosen)
        self.address = QLineEdit()
        self.address.setPlaceholderText(ADDRESS_HINT)
        self.address.setAccessibleName("Address of the HoloLens")
        self.address.textEdited.connect(self._chosen)
        self.picture = QLabel("no picture yet")
        self.picture.setObjectName("faint")
        self.picture.setAccessibleName("What the local user sees")
        self.picture.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.picture.setFixedSize(WIDTH_PX + 2, HEIGHT_PX + 2)
        self.values: dict[str, QLabel] = {}
        self.sentence = QLabel()
        self.sentence.setWordWrap(True)
        self.sentence.setAccessibleName("What to do about the HoloLens")
        row = QHBoxLayout()
        row.setSpacing(12)
        row.addWidget(self.picture, 0, Qt.AlignmentFlag.AlignTop)
        row.addLayout(self._make_figures(), 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.addWidget(self.is_worn)
        layout.addWidget(self.address)
        layout.addWidget(self.sentence)
        layout.addLayout(row)
        layout.addStretch(1)
        self.recolour()
        self.refresh()

    def _make_figures(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(2)
        grid.setColumnStretch(1, 1)
        for row, figure in enumerate(figures_of(None)):
            title, value = QLabel(figure.name), QLabel("–")
            title.setObjectName("faint")
            value.setAlignment(Qt.AlignmentFlag.AlignRight)
            value.setAccessibleName(figure.name)
            # A number that grows wider must not move what is beside it.
            value.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
            grid.addWidget(title, row, 0)
            grid.addWidget(value, row, 1)
            self.values[figure.name] = value
        return grid

    def refresh(self) -> None:
        """Show what is chosen."""
        choice, is_running = self._live.choice, self._live.is_running
        self.is_worn.blockSignals(True)
        self.is_worn.setChecked(choice.wears)
        self.is_worn.blockSignals(False)
        self.is_worn.setEnabled(not is_running)
        if self.address.text() != choice.headset:
            self.address.setText(choice.headset)
        self.address.setVisible(choice.wears and not choice.is_simulated)
        self.address.setEnabled(not is_running)
        if not is_running:
            self.show_idle()

    def show_idle(self) -> None:
        """No session plays: nothing is shown."""
        self._shown_seq = None
        self.picture.setPixmap(QPixmap())
        self.picture.setText("no picture yet")
        self._show_figures(None)
        choice = self._live.choice
        words = "A simulated one is worn." if choice.wears and choice.is_simulated else ""
        self._say(words or ("" if choice.wears else "Nobody wears one."), "")

    def show_session(self, session: LiveSession, status: LiveStatus) -> None:
        """Show the headset of a session that plays."""
        worn, headset = session.worn, status.headset
        if worn is None or headset is None:
            self._say("Nobody wears one in this session.", "")
            return
        self._show_figures(headset)
        self._say(*sentence_of(headset))
        frame = worn.anchoring.picture
        if frame is not None and frame.seq != self._shown_seq and self.isVisible():
            self._shown_seq = frame.seq
            self.picture.setPixmap(QPixmap.fromImage(_image(_small(worn.view()))))

    def recolour(self) -> None:
        """Follow the theme."""
        theme = THEMES[self._bench.settings.theme]
        self.picture.setStyleSheet(
            f"border: 1px solid {theme.line}; background: {theme.field}; color: {theme.faint};"
        )

    def _show_figures(self, headset: WornStatus | None) -> None:
        theme = THEMES[self._bench.settings.theme]
        for figure in figures_of(headset):
            label = self.values[figure.name]
            label.setText(_marked(figure))
            label.setToolTip(figure.hint)
            label.setStyleSheet(f"color: {getattr(theme, figure.kind)};" if figure.kind else "")

    def _say(self, words: str, kind: str) -> None:
        theme = THEMES[self._bench.settings.theme]
        mark = f"{SHAPES[kind]} " if kind else ""
        self.sentence.setText(f"{mark}{words}" if words else "")
        self.sentence.setStyleSheet(f"color: {getattr(theme, kind or 'faint')};")

    def _chosen(self) -> None:
        live = self._live
        if not live.is_running:
            text = self.address.text()
            live.choose(replace(live.choice, wears=self.is_worn.isChecked(), headset=text))
        self.refresh()


def _marked(figure: Figure) -> str:
    return f"{SHAPES[figure.kind]} {figure.text}" if figure.kind else figure.text


def _small(picture: NDArray[np.uint8] | None) -> NDArray[np.uint8]:
    """Return a picture of the size that is shown, black where there is none."""
    if picture is None:
        return np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8)
    small = cv2.resize(picture, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _image(pixels: NDArray[np.uint8]) -> QImage:
    height, width = pixels.shape[:2]
    return QImage(pixels.tobytes(), width, height, 3 * width, QImage.Format.Format_RGB888).copy()
