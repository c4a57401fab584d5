"""The camera's picture, small, beside figures of its stream and of the recording."""

from __future__ import annotations

import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage, QPixmap
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from devices.camera.lenses.layout import LensLayout
from devices.camera.lenses.lens_pictures import lens_pictures
from devices.camera.received import CameraState, Received
from devices.camera.stream_decoder import StreamPicture
from devices.insta360.condition import LOW_BATTERIES
from studio.app.live.words import age_words, size_words
from studio.app.model.workbench import Workbench
from studio.app.shell.theme import SHAPES, THEMES, figures
from studio.live.live import LiveSession
from studio.live.shortfalls import MIN_HZ, drop_words
from studio.live.status import LiveState, LiveStatus

GAP_PX = 4
"""Pixels between two lens pictures."""


def lens_thumbnail(
    received: Received, layout: LensLayout | None, *, side_px: int
) -> NDArray[np.uint8]:
    """Return the camera's picture, its lens pictures upright beside each other.

    Args:
        received: its newest picture.
        layout: how that holds the lenses; None shows it as it came.
        side_px: height, even.

    Returns:
        (side, W, 4) uint8 RGBA, transparent between the pictures.
    """
    if layout is None:
        pictures = [_shrunk(picture, side_px) for picture in received.pictures]
    else:
        pictures = [
            lens
            for picture in received.pictures
            for lens in lens_pictures(picture, layout, lens_size_px=side_px)
        ]
    width = sum(picture.shape[1] for picture in pictures) + GAP_PX * (len(pictures) - 1)
    out = np.zeros((side_px, width, 4), np.uint8)
    left = 0
    for picture in pictures:
        right = left + picture.shape[1]
        out[: picture.shape[0], left:right, :3] = picture
        out[: picture.shape[0], left:right, 3] = 255
        left = right + GAP_PX
    return out


def _shrunk(picture: StreamPicture, height_px: int) -> NDArray[np.uint8]:
    """A whole picture of a height; its planes are shrunk before they become colours."""
    width_px = max(2, round(picture.width_px * height_px / picture.height_px) & ~1)
    planes = [
        np.asarray(cv2.resize(plane, size, interpolation=cv2.INTER_AREA), np.uint8)
        for plane, size in (
            (picture.y, (width_px, height_px)),
            (picture.u, (width_px // 2, height_px // 2)),
            (picture.v, (width_px // 2, height_px // 2)),
        )
    ]
    return picture.to_rgb(planes[0], planes[1], planes[2])


SIDE_PX = 116
"""Side of a lens picture, chosen: up and down of a room can be seen in it."""

WIDTH_PX = 2 * SIDE_PX + GAP_PX
"""Most that the pictures take beside each other."""

FIGURES = ("Last picture", "Rate", "Tracked", "Dropped", "Gaps", "Recording", "Camera")
"""Titles of the figures beside the picture."""

RATE_S = 2.0
"""Seconds over which pictures are counted."""

CAUSE_LINES = 2
"""Of the sentence below the figures."""


class CameraView(QWidget):
    """The camera's upright lens pictures and the figures of its stream.

    Args:
        bench: for the theme.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self._shown: tuple[int, LensLayout | None] | None = None
        self._is_idle = True
        self._rates = Rates()
        self.picture = QLabel("no picture yet")
        self.picture.setObjectName("faint")
        self.picture.setAccessibleName("Picture of the camera")
        self.picture.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.picture.setFixedSize(WIDTH_PX + 2, SIDE_PX + 2)
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(2)
        grid.setColumnStretch(1, 1)
        self.values: dict[str, QLabel] = {}
        for row, name in enumerate(FIGURES):
            title, value = QLabel(name), QLabel("–")
            title.setObjectName("faint")
            value.setAlignment(Qt.AlignmentFlag.AlignRight)
            value.setAccessibleName(name)
            # A number that grows wider must not move what is beside it.
            value.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
            grid.addWidget(title, row, 0)
            grid.addWidget(value, row, 1)
            self.values[name] = value
        grid.setRowStretch(len(FIGURES), 1)
        row = QHBoxLayout()
        row.setSpacing(12)
        row.addWidget(self.picture, 0, Qt.AlignmentFlag.AlignTop)
        row.addLayout(grid, 1)
        self.cause = QLabel()
        self.cause.setWordWrap(True)
        self.cause.setAccessibleName("Why pictures are dropped")
        # What it says must not move what is below it.
        self.cause.setMinimumHeight(CAUSE_LINES * self.fontMetrics().lineSpacing())
        self.cause.setAlignment(Qt.AlignmentFlag.AlignTop)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 8)
        layout.setSpacing(4)
        layout.addLayout(row)
        layout.addWidget(self.cause)
        self.recolour()

    def show_idle(self) -> None:
        """No session plays: nothing is shown."""
        if self._is_idle:
            return
        self._is_idle, self._shown = True, None
        self.picture.setPixmap(QPixmap())
        self.picture.setText("no picture yet")
        self._rates = Rates()
        self.cause.clear()
        for name in self.values:
            self._put(name, "–")
            self._colour(name, "")

    def show_session(
        self,
        session: LiveSession,
        status: LiveStatus,
        *,
        layout: LensLayout | None,
        is_simulated: bool = False,
    ) -> None:
        """Show a session.

        Args:
            session: whose picture.
            status: of it.
            layout: how its picture holds the lenses, as far as that is known.
            is_simulated: whether this computer plays the camera, too.
        """
        self._is_idle = False
        self._show_picture(session, layout)
        camera = status.camera
        is_held = camera.state is CameraState.HELD
        mark = f"{SHAPES['warning']} " if is_held else ""
        self._put("Last picture", mark + age_words(camera.last_age_ns))
        self._colour("Last picture", "warning" if is_held else "")
        self._rates.count(camera.pictures, status, time.monotonic())
        self._put("Rate", f"{figures(self._rates.decoded_hz, '5.1f')} /s")
        self._put("Tracked", f"{figures(status.frames, '7d')}")
        self._show_drops(status, is_simulated=is_simulated)
        gaps = sum(event.kind == "camera-gap" for event in session.events())
        self._put("Gaps", f"{gaps}, {camera.damaged} damaged")
        self._colour("Gaps", "warning" if gaps or camera.damaged else "")
        self._show_recording(session, status)
        self._show_condition(status)

    def recolour(self) -> None:
        """Follow the theme."""
        theme = THEMES[self._bench.settings.theme]
        self.picture.setStyleSheet(
            f"border: 1px solid {theme.line}; background: {theme.field}; color: {theme.faint};"
        )

    def _show_picture(self, session: LiveSession, layout: LensLayout | None) -> None:
        received = session.picture
        if received is None:
            return
        key = received.seq, layout
        if key == self._shown:
            return
        self._shown = key
        pixels = lens_thumbnail(received, layout, side_px=SIDE_PX)
        pixmap = QPixmap.fromImage(_image(pixels))
        if pixmap.width() > WIDTH_PX:
            pixmap = pixmap.scaledToWidth(WIDTH_PX, _SMOOTH)
        self.picture.setPixmap(pixmap)

    def _show_recording(self, session: LiveSession, status: LiveStatus) -> None:
        path = session.record_to
        if status.recording_failure:
            self._put("Recording", f"{SHAPES['bad']} stopped")
            self._colour("Recording", "bad")
        elif path is None:
            self._put("Recording", "off")
            self._colour("Recording", "")
        else:
            size = _size(path)
            is_on = status.state in (LiveState.FINDING, LiveState.READY, LiveState.LIVE)
            self._put("Recording", f"{SHAPES['good']} {size_words(size)}" if is_on else "not yet")
            self._colour("Recording", "good" if is_on else "")

    def _show_condition(self, status: LiveStatus) -> None:
        """Battery of a camera that says it; all that it says in the tool tip."""
        condition = status.condition
        text, kind = "–", ""
        if condition is not None and condition.battery is not None:
            if condition.battery <= max(LOW_BATTERIES):
                kind = "bad" if condition.battery <= min(LOW_BATTERIES) else "warning"
            mark = f"{SHAPES[kind]} " if kind else ""
            text = f"{mark}battery {condition.battery:.0%}"
        self._put("Camera", text)
        self._colour("Camera", kind)
        self.values["Camera"].setToolTip("" if condition is None else condition.text)

    def _show_drops(self, status: LiveStatus, *, is_simulated: bool) -> None:
        """How many pictures were not tracked; while there are many, why, and what to do."""
        came_hz, tracked_hz = self._rates.came_hz, self._rates.tracked_hz
        words, kind = "", ""
        if status.state is LiveState.LIVE:
            words = drop_words(came_hz=came_hz, tracked_hz=tracked_hz, is_simulated=is_simulated)
        if words:
            kind = "bad" if tracked_hz < MIN_HZ else "warning"
        share = status.dropped / max(status.frames + status.dropped, 1)
        mark = f"{SHAPES[kind]} " if kind else ""
        part = f" ({share:.0%})" if status.dropped else ""
        self._put("Dropped", f"{mark}{figures(status.dropped, '7d')}{part}")
        self._colour("Dropped", kind)
        if words and not self.cause.text():
            self._bench.say("warning", words)
        if self.cause.text() != words:
            self.cause.setText(words)
        theme = THEMES[self._bench.settings.theme]
        self.cause.setStyleSheet(f"color: {getattr(theme, kind)};" if kind else "")

    def _put(self, name: str, text: str) -> None:
        if self.values[name].text() != text:
            self.values[name].setText(text)

    def _colour(self, name: str, kind: str) -> None:
        theme = THEMES[self._bench.settings.theme]
        sheet = f"color: {getattr(theme, kind)};" if kind else ""
        if self.values[name].styleSheet() != sheet:
            self.values[name].setStyleSheet(sheet)


class Rates:
    """Pictures a second over the last `RATE_S`: decoded, sent to the tracker, and tracked."""

    def __init__(self) -> None:
        self.decoded_hz = self.came_hz = self.tracked_hz = 0.0
        self._since: tuple[int, int, int, float] | None = None

    def count(self, decoded: int, status: LiveStatus, now_s: float) -> None:
        """Take how many there were so far."""
        came, tracked = status.frames + status.dropped, status.frames
        since = self._since
        if since is None or decoded < since[0] or came < since[1]:
            self._since = decoded, came, tracked, now_s
            return
        took_s = now_s - since[3]
        if took_s >= RATE_S:
            self.decoded_hz = (decoded - since[0]) / took_s
            self.came_hz = (came - since[1]) / took_s
            self.tracked_hz = (tracked - since[2]) / took_s
            self._since = decoded, came, tracked, now_s


_SMOOTH = Qt.TransformationMode.SmoothTransformation


def _size(recording: Path) -> int:
    """Bytes on the disk, finished or not; 0 before there are any."""
    for path in (recording, recording.with_name(recording.name + ".part")):
        try:
            return path.stat().st_size
        except OSError:
            continue
    return 0


def _image(pixels: NDArray[np.uint8]) -> QImage:
    height, width = pixels.shape[:2]
    return QImage(pixels.tobytes(), width, height, 4 * width, QImage.Format.Format_RGBA8888).copy()
