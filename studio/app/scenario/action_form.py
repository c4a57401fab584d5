"""The form of one action: its keys as fields, below the blocks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from PySide6.QtWidgets import QLabel, QScrollArea, QVBoxLayout, QWidget

from studio.app.model.workbench import Workbench
from studio.app.scenario.action_blocks import Key
from studio.app.scenario.fields import ACTION_FIELDS
from studio.app.scenario.form import form_of
from studio.app.scenario.text.editing import ScenarioEditing
from studio.app.scenario.text.edits import values_of


class ActionForm(QWidget):
    """A title and the fields; hidden while no action is edited.

    Args:
        bench: whose action the fields do.
        editing: the scenario.
        objects: ids of the room's objects.
    """

    def __init__(
        self, bench: Workbench, editing: ScenarioEditing, objects: Callable[[], tuple[str, ...]]
    ) -> None:
        super().__init__()
        self._bench, self._editing, self._objects = bench, editing, objects
        self._edited: Key | None = None
        self.widget: QWidget | None = None
        """The fields; None while no action is edited."""
        self.title = QLabel()
        self._area = QScrollArea()
        self._area.setWidgetResizable(True)
        self._area.setFrameShape(QScrollArea.Shape.NoFrame)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.title)
        layout.addWidget(self._area, 1)
        self.hide()

    def edit(self, key: Key | None) -> None:
        """Show the form of an action; None closes it."""
        self._edited = key
        self._close()
        self.refresh()

    def refresh(self) -> None:
        """Show the text as it is, unless the form has the focus and is right already."""
        values = self._values()
        if values is None:
            self._edited = None
            self._close()
            return
        shown = {**values, "names": self._names()}
        if self.widget is not None and self.widget.property("values") == shown:
            return
        focus = self.window().focusWidget()
        if self.widget is not None and focus is not None and self.widget.isAncestorOf(focus):
            self.widget.setProperty("values", shown)
            return
        self._close()
        assert self._edited is not None
        person, index = self._edited
        do = str(values["do"])
        self.title.setText(f"{self._bench.name_of(person)}, {index + 1}. {do.replace('_', ' ')}")
        others = [p.person_id for p in self._editing.scenario.people if p.person_id != person]
        self.widget = form_of(
            ACTION_FIELDS[do],
            values,
            objects=self._objects(),
            people=others,
            name=self._bench.name_of,
            changed=partial(_change, self._bench, person, index),
        )
        self.widget.setProperty("values", shown)
        self._area.setWidget(self.widget)
        self.show()

    def _values(self) -> dict[str, Any] | None:
        if self._edited is None:
            return None
        person, index = self._edited
        for values in values_of(self._editing.text).get("people", []):
            actions = values.get("actions", [])
            if values.get("id") == person and index < len(actions):
                return dict(actions[index])
        return None

    def _names(self) -> list[str]:
        people = [person.person_id for person in self._editing.scenario.people]
        return [self._bench.name_of(each) for each in (*self._objects(), *people)]

    def _close(self) -> None:
        self.title.clear()
        self.hide()
        if self.widget is not None:
            self._area.takeWidget()
            self.widget.deleteLater()
            self.widget = None


def _change(bench: Workbench, person: str, index: int, name: str, value: Any) -> None:
    keys = {"person": person, "index": index, "key": name, "value": value}
    bench.do("scenario.set_action", **keys)
