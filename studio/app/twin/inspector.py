"""The numbers of one item of the twin: read, and changed by spin boxes."""

from __future__ import annotations

import math
from collections.abc import Callable

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QWidget,
)

from studio.app.model.documents.added_mesh import METRES
from studio.app.model.workbench import Workbench
from studio.app.twin.edits import FARTHEST_M, TILTABLE, ItemKind, Stance
from studio.app.twin.items import TwinItem
from studio.app.twin.sizes import scale_of

PLACE_STEP_M, TURN_STEP_DEG, SIZE_STEP_M = 0.01, 1.0, 0.01
"""One press of an arrow: a centimetre, a degree."""
FRAME_ACTIONS = ("view.frame", "view.frame_selection", "viewport.frame")
"""Actions that bring what is selected into the view; the first that there is, is done."""


class Inspector(QWidget):
    """Name, place, heading, tilt, size, mass and certainty of what is selected.

    Args:
        bench: whose actions the numbers do.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self._item: TwinItem | None = None
        self.name = QLineEdit()
        self.name.setAccessibleName("name")
        self.name.editingFinished.connect(self._rename)
        self.place = [
            _spin(f"{axis} ", " m", PLACE_STEP_M, 3, FARTHEST_M, self._move) for axis in "xyz"
        ]
        self.yaw = _spin("", "°", TURN_STEP_DEG, 1, 180.0, self._turn)
        self.tilt = [_spin(f"{axis} ", "°", TURN_STEP_DEG, 1, 180.0, self._tilt) for axis in "xy"]
        for spin in (self.yaw, *self.tilt):
            spin.setWrapping(True)
        self.extent = [
            _spin(f"{axis} ", " m", SIZE_STEP_M, 3, 20.0, self._resize) for axis in "xyz"
        ]
        for spin in self.extent:
            spin.setMinimum(0.01)
        self.scale = _spin("", " × its file", 0.01, 3, 2000.0, self._rescale)
        self.scale.setMinimum(0.001)
        self.unit, self.up = QComboBox(), QComboBox()
        self.unit.addItems(list(METRES))
        self.up.addItems(["y", "z"])
        self.unit.setAccessibleName("unit of the file")
        self.up.setAccessibleName("upper axis of the file")
        self.unit.textActivated.connect(self._set_unit)
        self.up.textActivated.connect(self._set_up)
        self.sides = QLabel()
        self.state, self.mass, self.sigma = QLabel(), QLabel(), QLabel()
        self.sigma.setWordWrap(True)
        self.seen = QLabel()
        self.seen.setWordWrap(True)
        self.seen.setToolTip("View, Show sides that no photo saw: the rest, in orange")
        self.reset = _button("Reset", "back to where the scan has it", self._do("twin.reset"))
        self.frame = _button("Frame", "bring it into the view", self._frame)
        self.remove = _button("Remove", "take away what was added", self._do("twin.remove"))
        self._form = self._make_form()
        self.show_item(None)

    def _make_form(self) -> QFormLayout:
        form = QFormLayout(self)
        form.setContentsMargins(8, 6, 8, 8)
        form.setVerticalSpacing(4)
        form.setRowWrapPolicy(QFormLayout.RowWrapPolicy.WrapLongRows)
        form.addRow("Name", self.name)
        form.addRow("State", self.state)
        rows = (
            ("Place", self.place),
            ("Heading", [self.yaw]),
            ("Tilt", self.tilt),
            ("Size", self.extent),
            ("Scale", [self.scale]),
            ("Unit", [self.unit]),
            ("Up in file", [self.up]),
        )
        for title, fields in rows:
            for index, field in enumerate(fields):
                form.addRow("" if index else title, field)
        form.addRow("Size", self.sides)
        form.addRow("Mass", self.mass)
        form.addRow("Certainty", self.sigma)
        form.addRow("Photos", self.seen)
        buttons = QHBoxLayout()
        for button in (self.reset, self.frame, self.remove):
            buttons.addWidget(button)
        form.addRow(buttons)
        return form

    def show_item(self, item: TwinItem | None) -> None:
        """Show an item; None shows that nothing is selected. A field being typed in is left."""
        self._item = item
        self.setEnabled(item is not None)
        if item is None:
            _set_text(self.name, "")
            self.name.setPlaceholderText("nothing is selected")
            self.state.setText("")
            self.mass.setText("")
            self.sigma.setText("")
            self.seen.setText("")
            for spin in (*self.place, self.yaw, *self.tilt, *self.extent):
                _set_value(spin, 0.0)
            return
        if not self.name.hasFocus():
            _set_text(self.name, item.name)
        is_by_hand = self._bench.is_by_hand or item.kind is not ItemKind.OBJECT
        is_by_hand = is_by_hand and not item.is_of_session
        self.name.setReadOnly(item.is_of_session)
        self.state.setText(item.state)
        for spin, value in zip(self.place, item.world_from_item.translation.tolist(), strict=True):
            _set_value(spin, value)
            spin.setEnabled(is_by_hand)
        _set_value(self.yaw, item.yaw_deg or 0.0)
        self.yaw.setEnabled(item.yaw_deg is not None and is_by_hand)
        stance = Stance.of(item.kind, item.world_from_item)
        angles = (stance.tilt_x_deg, stance.tilt_y_deg)
        for spin, angle in zip(self.tilt, angles, strict=True):
            _set_value(spin, angle)
            spin.setEnabled(is_by_hand)
            self._form.setRowVisible(spin, item.kind in TILTABLE)
        self._show_size(item)
        about = "about " if item.kind is ItemKind.OBJECT else ""
        self._form.setRowVisible(self.mass, item.mass_kg is not None)
        self._form.setRowVisible(self.sigma, item.sigma is not None)
        self.mass.setText("–" if item.mass_kg is None else f"{about}{item.mass_kg:.2f} kg")
        self.sigma.setText(_certainty(item))
        self._form.setRowVisible(self.seen, bool(item.seen))
        self.seen.setText(item.seen)
        self.reset.setEnabled(item.is_moved and is_by_hand)
        self.remove.setEnabled(item.kind is not ItemKind.OBJECT and not item.is_of_session)
        self.frame.setEnabled(any(name in self._bench.actions for name in FRAME_ACTIONS))

    def _show_size(self, item: TwinItem) -> None:
        """Fields where a size can be changed, else one line: less to scroll past."""
        mesh = self._bench.document.twin.meshes.get(item.item_id)
        is_sized = item.kind in (ItemKind.PRIMITIVE, ItemKind.MESH) and not item.is_of_session
        for spin, side in zip(self.extent, item.size_m or (0.0, 0.0, 0.0), strict=True):
            _set_value(spin, side)
            spin.setEnabled(is_sized)
            self._form.setRowVisible(spin, is_sized)
        for field in (self.scale, self.unit, self.up):
            self._form.setRowVisible(field, mesh is not None)
        if mesh is not None:
            _set_value(self.scale, scale_of(mesh))
            self.unit.setCurrentText(mesh.unit)
            self.up.setCurrentText(mesh.up)
        self._form.setRowVisible(self.sides, not is_sized)
        sides = " × ".join(f"{side:.2f}" for side in item.size_m or ())
        self.sides.setText(f"{sides} m" if sides else "–")

    def _move(self) -> None:
        if self._item is not None:
            place = [round(spin.value(), 4) for spin in self.place]
            self._bench.do("twin.move", item=self._item.item_id, place=place)

    def _turn(self) -> None:
        if self._item is not None:
            yaw_deg = round(self.yaw.value(), 2)
            self._bench.do("twin.turn", item=self._item.item_id, yaw_deg=yaw_deg)

    def _tilt(self) -> None:
        if self._item is not None:
            x_deg, y_deg = (round(spin.value(), 2) for spin in self.tilt)
            self._bench.do("twin.tilt", item=self._item.item_id, x_deg=x_deg, y_deg=y_deg)

    def _rescale(self) -> None:
        if self._item is not None:
            factor = round(self.scale.value(), 3)
            self._bench.do("twin.scale", item=self._item.item_id, factor=factor)

    def _set_unit(self, unit: str) -> None:
        if self._item is not None and not self._bench.do(
            "twin.mesh_unit", item=self._item.item_id, unit=unit
        ):
            self.show_item(self._item)  # it is still read in the unit of before

    def _set_up(self, up: str) -> None:
        if self._item is not None:
            self._bench.do("twin.mesh_up", item=self._item.item_id, up=up)

    def _resize(self) -> None:
        if self._item is not None:
            size = [round(spin.value(), 4) for spin in self.extent]
            self._bench.do("twin.resize", item=self._item.item_id, size=size)

    def _rename(self) -> None:
        if self._item is not None and self.name.text().strip() != self._item.name:
            self._bench.do("twin.rename", item=self._item.item_id, name=self.name.text())

    def _frame(self) -> None:
        for name in FRAME_ACTIONS:
            if name in self._bench.actions:
                self._bench.do(name)
                return

    def _do(self, action_id: str) -> Callable[[], None]:
        def run() -> None:
            if self._item is not None:
                self._bench.do(action_id, item=self._item.item_id)

        return run


def _certainty(item: TwinItem) -> str:
    if item.confidence is None or item.sigma is None:
        return "–"
    x, y, z, yaw = item.sigma
    return (
        f"{100 * item.confidence:.0f} %\n± {1000 * x:.0f}, {1000 * y:.0f}, {1000 * z:.0f} mm, "
        f"{math.degrees(yaw):.1f}°"
    )


def _spin(
    prefix: str,
    suffix: str,
    step: float,
    decimals: int,
    limit: float,
    changed: Callable[[], None],
) -> QDoubleSpinBox:
    spin = QDoubleSpinBox()
    spin.setAccessibleName(f"{prefix}{suffix}".strip())
    spin.setDecimals(decimals)
    spin.setRange(-limit, limit)
    spin.setSingleStep(step)
    spin.setPrefix(prefix)
    spin.setSuffix(suffix)
    spin.setKeyboardTracking(False)  # a number counts when it has been typed, not at each digit
    spin.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    spin.valueChanged.connect(lambda _value: changed())
    return spin


def _button(title: str, hint: str, clicked: Callable[[], None]) -> QPushButton:
    button = QPushButton(title)
    button.setToolTip(hint)
    button.clicked.connect(lambda _checked=False: clicked())
    return button


def _set_value(spin: QDoubleSpinBox, value: float) -> None:
    """Show a number without doing anything by it, unless one is being typed there."""
    line = spin.lineEdit()
    if line is not None and line.isModified() and spin.hasFocus():
        return
    with QSignalBlocker(spin):
        spin.setValue(value)


def _set_text(line: QLineEdit, text: str) -> None:
    if line.text() != text:
        with QSignalBlocker(line):
            line.setText(text)
