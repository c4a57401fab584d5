"""The panel of people: let them in, a code for each, who is here and what they may."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.runs.guests import DoorState, Guests
from studio.app.model.workbench import Topic, Workbench
from studio.app.people.invitation_view import InvitationView
from studio.app.people.person_row import PersonRow
from studio.app.people.words import NETWORK_WARNING, STARTS, State, here_words
from studio.app.shell.theme import SHAPES, THEMES

POLL_MS = 250
"""Between two looks at who is here, milliseconds: seconds that are left go by evenly."""

LIGHTS = {
    DoorState.NO_SESSION: State("calm", "no live session"),
    DoorState.CLOSED: State("calm", "closed"),
    DoorState.OPENING: State("unknown", "opening"),
    DoorState.HERE: State("good", "open on this computer"),
    DoorState.NETWORK: State("good", "open to this network"),
}
"""States of the doors as they are shown."""


class PeopleDock(QWidget):
    """State and buttons on top, the code below, then everybody who is here.

    Args:
        bench: whose live session people join.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        guests = bench.shared(Guests)
        assert guests is not None, "made with the window"
        self._bench, self.guests = bench, guests
        self.rows: dict[str, PersonRow] = {}
        self.state, self.text = QLabel(), QLabel()
        self.state.setAccessibleName("Whether people can join")
        font = self.state.font()
        font.setBold(True)
        self.state.setFont(font)
        self.text.setWordWrap(True)
        self.let_in = QPushButton("Let people in")
        self.let_in.setDefault(True)
        self.let_in.setToolTip("browsers on this computer can join with a code (F7)")
        self.let_in.clicked.connect(lambda: bench.do("people.let_in"))
        self.network = QPushButton("Open to this network …")
        self.network.clicked.connect(lambda: bench.do("people.open_network"))
        self.shut = QPushButton("Close the doors")
        self.shut.setToolTip("everybody leaves; the session goes on")
        self.shut.clicked.connect(lambda: bench.do("people.close"))
        buttons = QHBoxLayout()
        for button in (self.let_in, self.network, self.shut):
            buttons.addWidget(button)
        buttons.addStretch(1)
        self.at_once = QCheckBox("Let people in as soon as a live session begins")
        self.at_once.setToolTip("the one button of the dock Live opens these doors, too")
        self.at_once.clicked.connect(lambda: bench.do("people.open_at_once"))
        self.invitation = InvitationView(bench, guests)
        self.here = QLabel()
        self.record = QPushButton()
        self.record.setCheckable(True)
        self.record.setToolTip("off at first; everybody's page says when it is on")
        self.record.clicked.connect(lambda: bench.do("people.record_voices"))
        self.undo = QPushButton("Undo")
        self.undo.clicked.connect(lambda: bench.do("people.undo"))
        above = QHBoxLayout()
        above.addWidget(self.here, 1)
        above.addWidget(self.record)
        above.addWidget(self.undo)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.addWidget(self.state)
        layout.addWidget(self.text)
        layout.addWidget(self.at_once)
        layout.addLayout(buttons)
        layout.addWidget(self._make_warning())
        layout.addWidget(self.invitation)
        layout.addLayout(above)
        layout.addWidget(self._make_list(), 1)
        for topic in (Topic.SESSION, Topic.SETTINGS):
            bench.listen(topic, self._on_change)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        self._timer.start(POLL_MS)
        self._on_change()

    def _make_warning(self) -> QWidget:
        self.warning = QFrame()
        self.warning.setObjectName("warning")
        words = QLabel(NETWORK_WARNING)
        words.setWordWrap(True)
        self.confirm = QPushButton("Open to this network")
        self.confirm.clicked.connect(lambda: self._bench.do("people.open_network", confirmed=True))
        self.refuse = QPushButton("Not now")
        self.refuse.clicked.connect(lambda: self.guests.ask_for_network(False))
        row = QHBoxLayout()
        row.addStretch(1)
        row.addWidget(self.refuse)
        row.addWidget(self.confirm)
        layout = QVBoxLayout(self.warning)
        layout.addWidget(words)
        layout.addLayout(row)
        self.warning.hide()
        return self.warning

    def _make_list(self) -> QWidget:
        content = QWidget()
        self._list = QVBoxLayout(content)
        self._list.setContentsMargins(0, 0, 0, 0)
        self._list.setSpacing(0)
        self._list.addStretch(1)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFrameShape(QFrame.Shape.NoFrame)
        area.setWidget(content)
        area.setAccessibleName("People who are here")
        return area

    def _on_change(self) -> None:
        theme = THEMES[self._bench.settings.theme]
        self.warning.setStyleSheet(
            f"#warning {{ border: 1px solid {theme.warning}; border-left: 4px solid "
            f"{theme.warning}; border-radius: 4px; background: {theme.field}; }}"
        )
        self.invitation.recolour()
        for row in self.rows.values():
            row.recolour()
        self.refresh()

    def _poll(self) -> None:
        if self.isVisible():
            self.refresh()

    def refresh(self) -> None:
        """Show how it is now."""
        guests, state = self.guests, self.guests.state
        light, theme = LIGHTS[state], THEMES[self._bench.settings.theme]
        self.state.setText(f"{SHAPES[light.kind]} {light.word}")
        colour = f"color: {getattr(theme, light.kind, theme.calm)};"
        if self.state.styleSheet() != colour:
            self.state.setStyleSheet(colour)
        self.text.setText(STARTS[state])
        is_open = guests.is_open
        self.at_once.setVisible(state is DoorState.NO_SESSION)
        self.at_once.setChecked(guests.opens_at_once)
        self.let_in.setVisible(not is_open)
        self.let_in.setEnabled(state is DoorState.CLOSED)
        can_widen = state in (DoorState.CLOSED, DoorState.HERE)
        self.network.setVisible(state is DoorState.HERE)
        self.network.setEnabled(not guests.asks_for_network)
        self.shut.setVisible(is_open)
        self.warning.setVisible(guests.asks_for_network and can_widen)
        self.invitation.setVisible(is_open)
        self.invitation.refresh()
        self._show_people()
        self.record.setVisible(is_open)
        is_recorded = guests.is_voice_recorded
        self.record.setChecked(is_recorded)
        self.record.setText("● Voices are recorded" if is_recorded else "Record voices")
        self.undo.setVisible(bool(guests.undoes))
        self.undo.setToolTip(f"undo: {guests.undoes}")

    def _show_people(self) -> None:
        people = self.guests.people()
        self.here.setText(here_words(len(people)))
        self.here.setVisible(self.guests.is_open)
        for gone in self.rows.keys() - {each.person_id for each in people}:
            self.rows.pop(gone).deleteLater()
        for each in people:
            row = self.rows.get(each.person_id)
            if row is None:
                row = self.rows[each.person_id] = PersonRow(self._bench, each)
                row.recolour()
                self._list.insertWidget(self._list.count() - 1, row)
            row.show_person(each, can_look=each.person_id in self._bench.state.avatars)

    def closeEvent(self, event: QCloseEvent) -> None:
        """No longer follow the bench: the window closes."""
        self._timer.stop()
        self._bench.stop_listening(self._on_change)
        event.accept()
