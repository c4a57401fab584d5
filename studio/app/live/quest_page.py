"""Headsets of people who have joined by the page, in the panel: how each is doing, what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QVBoxLayout, QWidget

from studio.app.devices.checks_table import KINDS
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.workbench import Workbench
from studio.app.shell.theme import SHAPES, THEMES

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from devices.hub.attendance import PageHeadset
    from studio.session.preflight import Check

NOBODY = (
    "Nobody has joined with a headset. Let people in with the dock People, open the address in the "
    "browser of a Quest, join, and press Enter VR; Enter AR in the room itself."
)
"""Words where there is none."""


class QuestPage(QWidget):
    """A block for each headset: name, figures, and a sentence.

    Args:
        bench: for the theme.
        live: the live session.
    """

    def __init__(self, bench: Workbench, live: LiveRun) -> None:
        super().__init__()
        self._bench, self._live = bench, live
        self.blocks: dict[str, HeadsetBlock] = {}
        self.sentence = QLabel(NOBODY)
        self.sentence.setObjectName("faint")
        self.sentence.setWordWrap(True)
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(8, 8, 8, 8)
        self._layout.addWidget(self.sentence)
        self._layout.addStretch(1)

    def refresh(self) -> None:
        """Show the headsets that are there now."""
        job = self._live.job
        found = () if job is None or not job.running else job.headsets()
        for gone in self.blocks.keys() - {each.person.person_id for each in found}:
            block = self.blocks.pop(gone)
            self._layout.removeWidget(block)
            block.deleteLater()
        for headset in found:
            key = headset.person.person_id
            if key not in self.blocks:
                self.blocks[key] = HeadsetBlock(self._bench)
                self._layout.insertWidget(self._layout.count() - 1, self.blocks[key])
            self.blocks[key].show_headset(headset)
        self.sentence.setVisible(not found)


class HeadsetBlock(QFrame):
    """One headset.

    Args:
        bench: for the theme.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        from studio.live.people.headsets import ASPECTS

        self._bench = bench
        self.title, self.sentence = _plain(), _plain()
        font = self.title.font()
        font.setBold(True)
        self.title.setFont(font)
        self.sentence.setWordWrap(True)
        self.values: dict[str, QLabel] = {}
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(2)
        grid.setColumnStretch(1, 1)
        for row, name in enumerate(ASPECTS):
            title, value = QLabel(name), _plain()
            title.setObjectName("faint")
            value.setAlignment(Qt.AlignmentFlag.AlignRight)
            grid.addWidget(title, row, 0)
            grid.addWidget(value, row, 1)
            self.values[name] = value
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 8)
        layout.addWidget(self.title)
        layout.addWidget(self.sentence)
        layout.addLayout(grid)

    def show_headset(self, headset: PageHeadset) -> None:
        """Show how it is doing."""
        from studio.live.people.headsets import checks_of

        theme, name = THEMES[self._bench.settings.theme], headset.person.name
        checks = checks_of(headset)
        self.title.setText(name)
        for check in checks:
            kind = "" if check.verdict == "PASS" else KINDS[check.verdict]
            label = self.values[check.name]
            label.setText(f"{SHAPES[kind]} {check.what}" if kind else check.what)
            label.setToolTip(check.fix)
            label.setAccessibleName(f"{name}: {check.name}")
            _colour(label, getattr(theme, kind) if kind else "")
        words, kind = sentence_of(checks, name)
        self.sentence.setText(f"{SHAPES[kind]} {words}")
        self.sentence.setAccessibleName(f"What to do about the headset of {name}")
        _colour(self.sentence, getattr(theme, kind))


def _colour(label: QLabel, colour: str) -> None:
    """Colour a label; Qt draws it anew only where that is another one."""
    style = f"color: {colour};" if colour else ""
    if label.styleSheet() != style:
        label.setStyleSheet(style)


def _plain() -> QLabel:
    """Return a label for strangers' words, of which no markup is drawn."""
    label = QLabel()
    label.setTextFormat(Qt.TextFormat.PlainText)
    return label


def sentence_of(checks: tuple[Check, ...], name: str) -> tuple[str, str]:
    """Return what is to be done first, and of which kind it is."""
    for check in checks:
        if check.verdict != "PASS":
            return f"{check.fix[:1].upper()}{check.fix[1:]}.", KINDS[check.verdict]
    return f"{name} is in the room.", "good"
