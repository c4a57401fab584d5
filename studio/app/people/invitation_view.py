"""The code to join, large, with its QR code and the time that is left."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.runs.guests import ROLES, Guests
from studio.app.model.workbench import Workbench
from studio.app.people.words import EXPIRES_SOON_S, ROLE_HINTS, code_words, time_words
from studio.app.shell.theme import THEMES

CODE_SIZE = 2.6
"""Letters of the code over the window's: read across a table."""

QR_PX = 164
"""Edge of the QR code, pixels: 4 a module of a usual address, which a phone reads at arm's
length."""

NO_CODE = "no code"
"""Words in the place of a code."""

QUIET = 4
"""Modules of white around the code, as its standard (ISO/IEC 18004) asks for."""


class QrView(QWidget):
    """A QR code: dark on white in both themes, as cameras expect it."""

    def __init__(self) -> None:
        super().__init__()
        self._text = ""
        self.setAccessibleName("QR code of the link to join")
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        """See Qt."""
        return QSize(QR_PX, QR_PX)

    def show_text(self, text: str) -> None:
        """Show another text; "" shows none."""
        if text != self._text:
            self._text = text
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        if not self._text:
            return
        painter = QPainter(self)
        modules = qr_modules(self._text)
        step = max(1, min(self.width(), self.height()) // len(modules))
        edge = step * len(modules)
        left, top = (self.width() - edge) // 2, (self.height() - edge) // 2
        painter.fillRect(QRectF(left, top, edge, edge), QColor("#ffffff"))
        for row, columns in enumerate(modules):
            for column in columns.nonzero()[0].tolist():
                square = QRectF(left + step * column, top + step * row, step, step)
                painter.fillRect(square, QColor("#000000"))


class InvitationView(QWidget):
    """Code, squares, time left, and what to do with them.

    Args:
        bench: does what the buttons ask for.
        guests: whose code it is.
    """

    def __init__(self, bench: Workbench, guests: Guests) -> None:
        super().__init__()
        self._bench, self._guests = bench, guests
        self.code = QLabel()
        self.code.setAccessibleName("Code to join")
        self.code.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.left = QLabel()
        self.address = QLabel()
        self.address.setWordWrap(True)
        self.address.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.role = QComboBox()
        self.role.setAccessibleName("Role of who comes in with the code")
        for role, word in ROLES.items():
            self.role.addItem(word, role)
            self.role.setItemData(
                self.role.count() - 1, ROLE_HINTS[role], Qt.ItemDataRole.ToolTipRole
            )
        self.role.activated.connect(self._choose_role)
        self.copy = QPushButton("Copy link")
        self.copy.setToolTip("with the code in it: whoever opens it first comes in")
        self.copy.clicked.connect(lambda: bench.do("people.copy_link"))
        self.again = QPushButton("New code")
        self.again.setToolTip("for the next person, or when the time is over")
        self.again.clicked.connect(lambda: bench.do("people.new_code"))
        self.qr = QrView()
        buttons = QHBoxLayout()
        buttons.addWidget(self.copy)
        buttons.addWidget(self.again)
        buttons.addStretch(1)
        comes = QHBoxLayout()
        comes.addWidget(QLabel("Comes in as"))
        comes.addWidget(self.role)
        comes.addStretch(1)
        words = QVBoxLayout()
        for part in (self.code, self.left, self.address):
            words.addWidget(part)
        words.addLayout(comes)
        words.addLayout(buttons)
        words.addStretch(1)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(12)
        layout.addWidget(self.qr, 0, Qt.AlignmentFlag.AlignTop)
        layout.addLayout(words, 1)
        self.recolour()

    def refresh(self) -> None:
        """Show the code as it is now."""
        invitation, seconds = self._guests.invitation, self._guests.seconds_left()
        is_good = invitation is not None and seconds > 0.0
        code = code_words(invitation.code) if invitation is not None and is_good else NO_CODE
        url = invitation.url if invitation is not None and is_good else ""
        self.code.setText(code)
        self.qr.show_text(url)
        self.address.setText(url.partition("#")[0])
        text = time_words(seconds) if invitation is not None else "used: make one for the next"
        self.left.setText(text)
        theme = THEMES[self._bench.settings.theme]
        colour = theme.warning if seconds < EXPIRES_SOON_S else theme.faint
        if self.left.styleSheet() != f"color: {colour};":
            self.left.setStyleSheet(f"color: {colour};")
        self.copy.setEnabled(is_good)
        place = self.role.findData(self._guests.role)
        if place != self.role.currentIndex():
            self.role.setCurrentIndex(place)

    def recolour(self) -> None:
        """Follow the theme, and the size of its letters."""
        font = self.font()
        font.setPointSizeF(CODE_SIZE * font.pointSizeF())
        font.setBold(True)
        self.code.setFont(font)

    def _choose_role(self) -> None:
        self._bench.do("people.new_code", role=str(self.role.currentData()))


@lru_cache(maxsize=4)
def qr_modules(text: str) -> NDArray[np.bool_]:
    """Return (N, N) whether each module of a text's QR code is dark, with white around.

    Raises:
        ValueError: the text is empty or too long for one.
    """
    import zxingcpp

    if not text:
        raise ValueError("qr code: the text is empty")
    library: Any = zxingcpp
    code = library.create_barcode(text, library.BarcodeFormat.QRCode, ec_level="M")
    picture = library.write_barcode_to_image(code, scale=1, add_quiet_zones=False)
    dark = np.pad(np.array(picture) < 128, QUIET)
    dark.setflags(write=False)
    return dark
