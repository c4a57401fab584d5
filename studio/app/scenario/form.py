"""A form made of a table's fields: one row a key, a number with its unit and range."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QSlider,
    QWidget,
)

from studio.app.model.names import distinct_names
from studio.app.scenario.fields import Field

Changed = Callable[[str, Any], object]
"""Takes a key and its new value; None where the key is to go."""

NARROWEST, USUAL, ARROWS_PX = "-000.0°", "-000.00 share", 24
"""Texts that a number has room for in the narrowest dock and beside a slider, where those of a form
end at one place; and what frame and arrows take, pixels."""

STEPS = 200
"""Of a slider."""
SLIDER_SPAN: Mapping[str, tuple[float, float]] = {
    "delay_ms": (0.0, 1000.0),
    "jitter_ms": (0.0, 200.0),
    "clock_drift_ppm": (-1000.0, 1000.0),
    "px": (0.0, 12.0),
    "lasts_s": (0.0, 5.0),
}
"""Range of a slider where the whole would be too coarse; numbers reach further."""


class Number(QDoubleSpinBox):
    """A number that the wheel does not change by accident.

    Args:
        field: for unit and range.
        value: None where the key is missing.
        changed: called with each new value.
    """

    def __init__(self, field: Field, value: float | None, changed: Changed) -> None:
        super().__init__()
        is_optional = field.usual is None
        span = field.high - field.low
        step = 1.0 if span > 50 else 0.1 if span > 2.5 else 0.05
        self.setDecimals(0 if field.kind == "count" else 2)
        self.setSingleStep(1.0 if field.kind == "count" else step)
        self.setRange(field.low - (step if is_optional else 0.0), field.high)
        if is_optional:
            self.setSpecialValueText("not set")
        self.setSuffix(field.unit if field.unit == "°" else f" {field.unit}" if field.unit else "")
        self.setMinimumWidth(self.fontMetrics().horizontalAdvance(NARROWEST) + ARROWS_PX)
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(field.title)
        self.setToolTip(f"{field.title}: {field.low:g} to {field.high:g} {field.unit}".strip())
        self.setValue(self.minimum() if value is None else value)

        def emit(now: float) -> None:
            if is_optional and now < field.low:
                changed(field.key, None)
            else:
                changed(field.key, int(now) if field.kind == "count" else now)

        self.valueChanged.connect(emit)

    def textFromValue(self, val: float) -> str:
        """See Qt: without noughts at the end."""
        text = super().textFromValue(val)
        point = self.locale().decimalPoint()
        return text.rstrip("0").removesuffix(point) if point in text else text

    def wheelEvent(self, event: Any) -> None:
        """Scroll what is around it unless it is being edited."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


def form_of(
    fields: Sequence[Field],
    values: Mapping[str, Any],
    *,
    objects: Sequence[str],
    people: Sequence[str],
    name: Callable[[str], str],
    changed: Changed,
    sliders: bool = False,
) -> QWidget:
    """The form.

    Args:
        fields: its rows.
        values: by key, where there are any.
        objects: ids that may be chosen.
        people: ids that may be chosen.
        name: what the object or person of an id is called.
        changed: called with each change.
        sliders: whether numbers have a slider, too.
    """
    widget = QWidget()
    layout = QFormLayout(widget)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.ExpandingFieldsGrow)
    for field in fields:
        value = values.get(field.key)
        match field.kind:
            case "number" | "count":
                number = Number(field, value, changed)
                has_slider = sliders and field.usual is not None
                row: QWidget = _with_slider(number, field) if has_slider else number
            case "object" | "person":
                known = objects if field.kind == "object" else people
                row = _named_choice(field, value, known, name=name, changed=changed)
            case "choice":
                row = _choice(field, value, field.choices, changed)
            case _:
                row = _numbers(field, value, changed)
        in_metres = field.kind in ("place", "place3", "line")
        layout.addRow(f"{field.title}, m" if in_metres else field.title, row)
    return widget


def _with_slider(number: Number, field: Field) -> QWidget:
    low, high = SLIDER_SPAN.get(field.key, (field.low, field.high))
    slider = QSlider(Qt.Orientation.Horizontal)
    slider.setRange(0, STEPS)
    slider.setAccessibleName(field.title)
    slider.setMinimumWidth(60)

    def follow(value: float) -> None:
        slider.blockSignals(True)
        slider.setValue(round((value - low) / (high - low) * STEPS))
        slider.blockSignals(False)

    follow(number.value())
    number.valueChanged.connect(follow)
    slider.valueChanged.connect(lambda k: number.setValue(low + (high - low) * k / STEPS))
    number.setFixedWidth(number.fontMetrics().horizontalAdvance(USUAL) + ARROWS_PX)
    row = QWidget()
    layout = QHBoxLayout(row)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.addWidget(slider, 1)
    layout.addWidget(number)
    return row


def _choice(field: Field, value: Any, known: Sequence[str], changed: Changed) -> QComboBox:
    box = QComboBox()
    none = "not set"
    names = [*([none] if field.usual is None else []), *known]
    if value is not None and value not in names:
        names.append(str(value))
    box.addItems(names)
    box.setCurrentText(none if value is None else str(value))
    box.setAccessibleName(field.title)
    box.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    box.textActivated.connect(lambda text: changed(field.key, None if text == none else text))
    return box


def _named_choice(
    field: Field, value: Any, known: Sequence[str], *, name: Callable[[str], str], changed: Changed
) -> QComboBox:
    """Names to choose from; ids in the text, and beside names that two have."""
    box = QComboBox()
    if field.usual is None:
        box.addItem("not set", None)
    ids = [*known, *([] if value is None or value in known else [str(value)])]
    for item_id, words in zip(ids, distinct_names(ids, name), strict=True):
        box.addItem(words, item_id)
        box.setItemData(box.count() - 1, f"{item_id} in texts", Qt.ItemDataRole.ToolTipRole)
    box.setCurrentIndex(box.findData(value))
    if value is not None:
        box.setToolTip(f"{value} in texts")
    box.setAccessibleName(field.title)
    box.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    box.activated.connect(lambda row: changed(field.key, box.itemData(row)))
    return box


def _numbers(field: Field, value: Any, changed: Changed) -> QLineEdit:
    """Places as text: `1.2, 0.4`; corners of a line are parted by semicolons."""
    line = QLineEdit(numbers_text(value))
    line.setAccessibleName(field.title)
    line.setToolTip(
        {
            "place": "x, y in metres",
            "place3": "x, y, z in metres",
            "colour": "red, green, blue 0-1",
        }.get(field.kind, "x, y, z; x, y, z; … in metres")
    )

    def emit() -> None:
        if line.text() == numbers_text(value):
            return
        try:
            changed(field.key, numbers_of(line.text(), is_line=field.kind == "line"))
        except ValueError:
            line.setText(numbers_text(value))

    line.editingFinished.connect(emit)
    return line


def numbers_text(value: Any) -> str:
    """Numbers as people write them."""
    if value is None:
        return ""
    items = cast(Sequence[Any], value)
    if items and isinstance(items[0], list | tuple):
        return "; ".join(numbers_text(item) for item in items)
    return ", ".join(f"{number:g}" for number in items)


def numbers_of(text: str, *, is_line: bool) -> list[Any] | None:
    """Numbers out of what was written; None out of nothing.

    Raises:
        ValueError: it is no list of numbers.
    """
    if not text.strip():
        return None
    if is_line:
        return [numbers_of(part, is_line=False) for part in text.split(";")]
    return [float(part) for part in text.split(",")]
