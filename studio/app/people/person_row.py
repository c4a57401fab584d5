"""One person in the list: name, state, role, round trip, and what can be done with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
)

from studio.app.model.runs.guests import ROLES
from studio.app.model.workbench import Workbench
from studio.app.people.words import ROLE_HINTS, latency_words, state_of
from studio.app.shell.theme import SHAPES, THEMES

if TYPE_CHECKING:
    from devices.hub.roles import Person


WIDEST = max(map(len, ROLES.values()))
"""Letters of the longest role: the lists of all rows are equally wide."""


class PersonRow(QFrame):
    """Somebody who is here.

    Args:
        bench: does what the buttons ask for.
        person: who it is.
    """

    def __init__(self, bench: Workbench, person: Person) -> None:
        super().__init__()
        self._bench, self.person = bench, person
        self.name = QLabel()
        # A name is a stranger's text: no markup of it is drawn.
        self.name.setTextFormat(Qt.TextFormat.PlainText)
        self.name.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        font = self.name.font()
        font.setBold(True)
        self.name.setFont(font)
        self.state, self.latency = QLabel(), QLabel()
        self.latency.setToolTip("round trip of the newest ping")
        self.latency.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.role = QComboBox()
        for role, word in ROLES.items():
            self.role.addItem(word, role)
            self.role.setItemData(
                self.role.count() - 1, ROLE_HINTS[role], Qt.ItemDataRole.ToolTipRole
            )
        self.role.setMinimumContentsLength(WIDEST)
        self.role.activated.connect(self._choose_role)
        self.look = QPushButton("Look from theirs")
        self.look.setToolTip("the view follows their eyes until it is moved by hand")
        self.look.clicked.connect(self._follow)
        self.pen = QPushButton()
        self.pen.clicked.connect(self._give_pen)
        self.mute = QPushButton()
        self.mute.clicked.connect(self._mute)
        self.remove = QPushButton("Remove")
        self.remove.setToolTip("they need a new code to come back")
        self.remove.clicked.connect(self._remove)
        buttons = QHBoxLayout()
        for button in (self.look, self.pen, self.mute, self.remove):
            buttons.addWidget(button)
        buttons.addStretch(1)
        layout = QGridLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.setColumnStretch(0, 1)
        layout.addWidget(self.name, 0, 0)
        layout.addWidget(self.latency, 0, 1)
        layout.addWidget(self.role, 0, 2)
        layout.addWidget(self.state, 1, 0)
        layout.addLayout(buttons, 2, 0, 1, 3)
        self.setObjectName("person")
        self.show_person(person, can_look=False)

    def show_person(self, person: Person, *, can_look: bool) -> None:
        """Show how somebody is doing.

        Args:
            person: the same one, as they are now.
            can_look: whether their head is seen.
        """
        self.person = person
        state, theme = state_of(person), THEMES[self._bench.settings.theme]
        self.name.setText(person.name)
        self.name.setToolTip(f"{person.person_id}, {ROLES[str(person.role)]}")
        self.role.setAccessibleName(f"Role of {person.name}")
        self.state.setText(f"{SHAPES[state.kind]} {state.word}")
        colour = f"color: {getattr(theme, state.kind, theme.calm)};"
        if self.state.styleSheet() != colour:
            self.state.setStyleSheet(colour)
        self.latency.setText(latency_words(person))
        place = self.role.findData(str(person.role))
        if place != self.role.currentIndex() and not self.role.view().isVisible():
            self.role.setCurrentIndex(place)
        self.mute.setText("Unmute" if person.is_muted else "Mute")
        self.mute.setToolTip(
            "let them be seen and heard, and do things"
            if person.is_muted
            else "refuse their body, their voice and what they do"
        )
        self.look.setEnabled(can_look)
        self.pen.setText("Pen to all" if person.has_pen else "Give the pen")
        self.pen.setToolTip(
            "everybody draws again" if person.has_pen else "they alone may draw and put things"
        )
        self.pen.setEnabled(str(person.role) != "spectator")

    def recolour(self) -> None:
        """Follow the theme."""
        theme = THEMES[self._bench.settings.theme]
        self.setStyleSheet(f"#person {{ border-bottom: 1px solid {theme.line}; }}")

    def _choose_role(self) -> None:
        role = str(self.role.currentData())
        self._bench.do("people.set_role", person=self.person.person_id, role=role)

    def _follow(self) -> None:
        self._bench.do("people.follow", person=self.person.person_id)

    def _give_pen(self) -> None:
        self._bench.do("people.give_pen", person=self.person.person_id)

    def _mute(self) -> None:
        self._bench.do("people.mute", person=self.person.person_id, muted=not self.person.is_muted)

    def _remove(self) -> None:
        self._bench.do("people.remove", person=self.person.person_id)
