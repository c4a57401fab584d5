"""Form of the camera: its address, how its picture holds the lenses, where it stands."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from devices.camera.address import AddressError, parse_address
from devices.camera.lenses.layout import LENSES, Arrangement, LensLayout
from studio.app.model.own_address import reachable
from studio.app.model.runs.live_run import LiveRun, Step
from studio.app.model.workbench import Workbench
from studio.app.shell.theme import SHAPES, THEMES
from studio.app.shell.wrapping import WrappingRow
from studio.live.setup import AUTO, layout_text, parse_layout

EXAMPLES = (
    ("rtmp://:1935/live/room", "the camera's app streams to this computer (RTMP)"),
    ("rtsp://192.168.1.20/stream", "this computer fetches it from the camera (RTSP)"),
    ("insta360://192.168.42.1", "an Insta360 camera in its own Wi-Fi"),
    ("udp://:5000", "MPEG-TS that is sent to this computer"),
    ("https://192.168.1.20/stream.m3u8", "HLS"),
    ("v4l2:/dev/video0", "a capture card or webcam"),
)
"""Addresses of each kind, and what they are for."""

ARRANGEMENTS = {
    AUTO: "found in the picture",
    Arrangement.SIDE_BY_SIDE: "side by side",
    Arrangement.STACKED: "one above the other",
    Arrangement.EQUIRECTANGULAR: "equirectangular",
    Arrangement.ONE_LENS: "one lens",
}
"""Titles of the arrangements."""

PLACES = {"find": "looked for in the room", "scan": "where the scan has it"}
"""Titles of the ways to know where the camera stands."""

CHOOSES = frozenset({Step.CHECK, Step.CONFIRM, Step.TRY_AGAIN})
"""Steps before which the layout can be chosen."""


_WIDE = QSizePolicy.Policy.Expanding
_LEFT = Qt.AlignmentFlag.AlignLeft
_TOOLTIP = Qt.ItemDataRole.ToolTipRole


class CameraPage(QWidget):
    """The form; what is typed becomes the live session's choice at once, right or wrong.

    Args:
        bench: does what the buttons ask for.
        live: the live session.
    """

    def __init__(self, bench: Workbench, live: LiveRun) -> None:
        super().__init__()
        self._bench, self._live = bench, live
        self.simulated = QCheckBox("simulated")
        self.simulated.setToolTip(
            "fails as real cameras do: bumped every 20 s, cut off once for 20 s"
        )
        self.simulated.toggled.connect(self._chosen)
        self.line = QLabel()
        self.line.setWordWrap(True)
        self.line.setSizePolicy(_WIDE, QSizePolicy.Policy.Preferred)
        form = QFormLayout()
        form.setLabelAlignment(_LEFT)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.ExpandingFieldsGrow)
        form.addRow("Camera", self._make_address())
        form.addRow("", self.line)
        self.enter_label, self.enter = QLabel("Enter in its app"), self._make_enter()
        form.addRow(self.enter_label, self.enter)
        form.addRow("Lenses", self._make_layout())
        self.place = QComboBox()
        self.place.setAccessibleName("Where the camera stands")
        self.place.setSizePolicy(_WIDE, QSizePolicy.Policy.Fixed)
        for place, words in PLACES.items():
            self.place.addItem(words, place)
        self.place.activated.connect(self._chosen)
        form.addRow("Place", self.place)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.addLayout(form)
        layout.addLayout(self._make_files())
        layout.addStretch(1)
        self.refresh()

    def _make_address(self) -> QWidget:
        self.address = QComboBox()
        self.address.setEditable(True)
        self.address.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.address.setAccessibleName("Address of the camera")
        self.address.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self._fill_addresses()
        self.address.setEditText(self._live.choice.address)
        self.address.editTextChanged.connect(self._chosen)
        return _row(self.address, self.simulated, wide=self.address)

    def _fill_addresses(self) -> None:
        typed = self.address.currentText()
        used = self._bench.settings.cameras
        examples = [(text, hint) for text, hint in EXAMPLES if text not in used]
        self.address.blockSignals(True)
        self.address.clear()
        for text, hint in (*((text, "used before") for text in used), *examples):
            self.address.addItem(text)
            self.address.setItemData(self.address.count() - 1, hint, _TOOLTIP)
        self.address.setEditText(typed)
        self.address.blockSignals(False)

    def _make_layout(self) -> QWidget:
        self.arrangement = QComboBox()
        self.arrangement.setAccessibleName("How the picture holds the lenses")
        for value, words in ARRANGEMENTS.items():
            self.arrangement.addItem(words, str(value))
        self.arrangement.activated.connect(self._laid_out)
        self.turns: list[QComboBox] = []
        for name in ("First", "Second"):
            turn = QComboBox()
            turn.setAccessibleName(f"{name} lens picture's turn clockwise")
            turn.setToolTip(f"the {name.lower()} lens picture is turned clockwise by this")
            for quarters in range(4):
                turn.addItem(f"{90 * quarters}°", quarters)
            turn.activated.connect(self._laid_out)
            self.turns.append(turn)
        return _row(self.arrangement, *self.turns, wide=self.arrangement)

    def _make_enter(self) -> QWidget:
        self.enter_text = QLineEdit()
        self.enter_text.setReadOnly(True)
        self.enter_text.setAccessibleName("Address to enter in the camera's app")
        copy = QPushButton("Copy")
        copy.clicked.connect(lambda: self._bench.do("live.copy_address"))
        return _row(self.enter_text, copy, wide=self.enter_text)

    def _make_files(self) -> WrappingRow:
        row = WrappingRow()
        for title, action in (
            ("Open devices …", "live.open_devices"),
            ("Save devices as TOML …", "live.save_devices"),
        ):
            button = QPushButton(title)
            button.setToolTip(self._bench.actions.get(action).hint)
            button.clicked.connect(lambda _=False, each=action: self._bench.do(each))
            row.addWidget(button)
        return row

    def refresh(self) -> None:
        """Show what is chosen, or what the session that plays has."""
        live = self._live
        choice, is_running = live.choice, live.is_running
        if self.address.currentText() != choice.address:
            self.address.blockSignals(True)
            self.address.setEditText(choice.address)
            self.address.blockSignals(False)
        self.simulated.blockSignals(True)
        self.simulated.setChecked(choice.is_simulated)
        self.simulated.blockSignals(False)
        self.place.setCurrentIndex(self.place.findData(choice.place))
        for widget in (self.simulated, self.place):
            widget.setEnabled(not is_running)
        self.address.setEnabled(not is_running and not choice.is_simulated)
        self._show_layout()
        self._show_line()
        session = live.session
        listening_at = "" if session is None else session.listening_at
        is_entered = bool(listening_at) and not choice.is_simulated
        self.enter_label.setVisible(is_entered)
        self.enter.setVisible(is_entered)
        shown = reachable(listening_at)
        if is_entered and self.enter_text.text() != shown:
            self.enter_text.setText(shown)

    def _show_layout(self) -> None:
        layout = self._live.shown_layout() if self._live.is_running else self._typed_layout()
        is_open = self._live.step in CHOOSES
        self.arrangement.setCurrentIndex(
            self.arrangement.findData(AUTO if layout is None else str(layout.arrangement))
        )
        self.arrangement.setEnabled(is_open)
        for place, combo in enumerate(self.turns):
            has_turn = layout is not None and place < len(layout.turns)
            combo.setVisible(has_turn)
            combo.setEnabled(is_open)
            if layout is not None and has_turn:
                combo.setCurrentIndex(layout.turns[place])

    def _show_line(self) -> None:
        problem = self.problem
        theme = THEMES[self._bench.settings.theme]
        self.line.setText(f"{SHAPES['bad']} {problem}" if problem else self._hint())
        self.line.setStyleSheet(f"color: {theme.bad if problem else theme.faint};")

    @property
    def problem(self) -> str:
        """Fault of the address that is typed, in words; empty if it has none."""
        choice = self._live.choice
        if choice.is_simulated:
            return ""
        try:
            parse_address(choice.address)
        except AddressError as error:
            return str(error)
        return ""

    @property
    def is_pushed(self) -> bool:
        """Whether a person has to enter an address in the camera's app."""
        choice = self._live.choice
        return not choice.is_simulated and choice.address.strip().lower().startswith("rtmp:")

    def _hint(self) -> str:
        choice = self._live.choice
        if choice.is_simulated:
            return "The room's script is filmed and streamed by a process beside this one."
        scheme = choice.address.partition(":")[0]
        for example, hint in EXAMPLES:
            if example.partition(":")[0] == scheme:
                return f"{hint[:1].upper()}{hint[1:]}."
        return "A video file is played as if it came from a camera."

    def _typed_layout(self) -> LensLayout | None:
        try:
            return parse_layout(self._live.choice.layout)
        except ValueError:
            return None

    def _laid_out(self) -> None:
        live, before = self._live, self._live.shown_layout()
        layout = self._layout_of_form(before or self._typed_layout())
        if live.is_running:
            live.look_at(layout)
        else:
            live.choose(replace(live.choice, layout=layout_text(layout)))
        self.refresh()

    def _layout_of_form(self, before: LensLayout | None) -> LensLayout | None:
        """As the boxes say; another arrangement begins upright."""
        value = self.arrangement.currentData()
        if value == AUTO:
            return None
        arrangement = Arrangement(value)
        count = LENSES[arrangement]
        if before is None or before.arrangement is not arrangement:
            return LensLayout(arrangement, (0,) * count)
        return LensLayout(arrangement, tuple(turn.currentIndex() for turn in self.turns[:count]))

    def _chosen(self) -> None:
        live = self._live
        if not live.is_running:
            live.choose(
                replace(
                    live.choice,
                    address=self.address.currentText(),
                    place=str(self.place.currentData()),
                    is_simulated=self.simulated.isChecked(),
                )
            )
        self.refresh()


def _row(*widgets: QWidget, wide: QWidget) -> QWidget:
    """Widgets beside each other, of which one takes what is left."""
    made = QWidget()
    layout = QHBoxLayout(made)
    layout.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        layout.addWidget(widget, 1 if widget is wide else 0)
    return made
