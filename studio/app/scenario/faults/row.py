"""One fault as knobs: a box that switches it on, and a form of its numbers."""

from __future__ import annotations

from typing import Any

from PySide6.QtWidgets import QCheckBox, QVBoxLayout, QWidget

from studio.app.model.workbench import Workbench
from studio.app.scenario.fields import Field
from studio.app.scenario.form import form_of
from studio.app.scenario.text.edits import FaultLine


class FaultRow(QWidget):
    """The row.

    Args:
        bench: whose actions it calls.
        name: of the fault.
        index: among those of its name.
        title: what people read.
        fields: of its form.
    """

    def __init__(
        self, bench: Workbench, name: str, index: int, *, title: str, fields: tuple[Field, ...]
    ) -> None:
        super().__init__()
        self.name, self.index = name, index
        self._bench, self._fields = bench, fields
        self._form: QWidget | None = None
        self._shown: FaultLine | None = None
        self._names: list[str] = []
        self.box = QCheckBox(title + (f" ({index + 1})" if index else ""))
        self.box.clicked.connect(self._switch)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 4)
        layout.setSpacing(2)
        layout.addWidget(self.box)

    def show_line(
        self, line: FaultLine | None, *, objects: tuple[str, ...], people: tuple[str, ...]
    ) -> None:
        """Show the fault as it is written; None if it is not. What has the focus stays as it is."""
        self.box.setChecked(line is not None)
        self.setVisible(line is not None or self.index == 0)
        names = [self._bench.name_of(each) for each in (*objects, *people)]
        is_same = self._shown is not None and line is not None and self._shown.values == line.values
        is_same = is_same and names == self._names
        self._shown, self._names = line, names
        if is_same or (line is not None and self._is_focused()):
            return
        if self._form is not None:
            self._form.hide()
            self._form.deleteLater()
            self._form = None
        if line is None:
            return
        self._form = form_of(
            self._fields,
            line.values,
            objects=objects,
            people=people,
            name=self._bench.name_of,
            changed=self._change,
            sliders=True,
        )
        margins = self._form.contentsMargins()
        self._form.setContentsMargins(22, margins.top(), 0, margins.bottom())
        layout = self.layout()
        assert layout is not None
        layout.addWidget(self._form)

    def _is_focused(self) -> bool:
        focus = self.window().focusWidget()
        return self._form is not None and focus is not None and self._form.isAncestorOf(focus)

    def _switch(self, is_on: bool) -> None:
        if is_on:
            done = self._bench.do("scenario.add_fault", name=self.name)
        else:
            done = self._bench.do("scenario.remove_fault", name=self.name, index=self.index)
        if not done:
            self.box.setChecked(self._shown is not None)

    def _change(self, key: str, value: Any) -> None:
        values = {"name": self.name, "field": key, "value": value, "index": self.index}
        self._bench.do("scenario.set_fault", **values)
