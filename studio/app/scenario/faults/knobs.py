"""Faults as knobs: a box a fault, with the tracker's errors of a trial beside them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.documents.arranged import arranged_text
from studio.app.model.workbench import Topic, Workbench
from studio.app.scenario.faults.error_bars import ErrorBars
from studio.app.scenario.faults.plugin_faults import fault_fields, title_of
from studio.app.scenario.faults.trial import TrialPlan, TrialResult, Trials
from studio.app.scenario.fields import FAULT_FIELDS, Field
from studio.app.scenario.form import form_of
from studio.app.scenario.text.editing import ScenarioEditing
from studio.app.scenario.text.edits import FaultLine, faults_of


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


DEBOUNCE_MS = 700
"""After the last change of a knob before a trial begins."""
POLL_MS = 80
LENGTHS_S = (3.0, 6.0, 12.0)


NOTHING_TRIED = (
    "Tick what goes wrong, then Try now: how far off is the tracker in the first seconds?"
)
CHANGED_SINCE = (
    "▲ these errors are of the scenario as it was before your last change: Try now for new ones"
)


class FaultKnobs(QWidget):
    """The knobs and the bars.

    Args:
        bench: whose actions the knobs call.
        editing: the scenario.
        objects: ids of the room's objects.
    """

    def __init__(
        self, bench: Workbench, editing: ScenarioEditing, objects: Callable[[], tuple[str, ...]]
    ) -> None:
        super().__init__()
        self._bench, self._editing, self._objects = bench, editing, objects
        self.trials = Trials()
        self._before: TrialResult | None = None
        self._now: TrialResult | None = None
        self._tried = ""
        self._rows: dict[tuple[str, int], FaultRow] = {}
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        self._make_trial_row(layout)
        self.bars = ErrorBars(bench.name_of)
        self.bars.hide()
        layout.addWidget(self.bars)
        inside = QWidget()
        self._list = QVBoxLayout(inside)
        self._list.setContentsMargins(0, 4, 8, 0)
        for name in fault_fields(bench.offered.faults):
            self._row(name, 0)
        self._list.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidget(inside)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QScrollArea.Shape.NoFrame)
        layout.addWidget(scroll, 1)
        self._debounce = QTimer(self)
        self._debounce.setSingleShot(True)
        self._debounce.timeout.connect(self.try_now)
        self._poll = QTimer(self)
        self._poll.timeout.connect(self.take_results)
        self._poll.start(POLL_MS)
        bench.listen(Topic.OFFERED, self._on_offered)
        bench.listen(Topic.OPENED, self.forget)

    def _make_trial_row(self, layout: QVBoxLayout) -> None:
        self._live = QCheckBox("Try each change")
        self._live.setToolTip("rehearse the first seconds in the background after each change")
        self._length = QComboBox()
        for seconds in LENGTHS_S:
            self._length.addItem(f"first {seconds:g} s", seconds)
        self._start = QPushButton("Try now")
        self._start.clicked.connect(self._on_button)
        row = QHBoxLayout()
        row.addWidget(self._live)
        row.addStretch(1)
        row.addWidget(self._length)
        row.addWidget(self._start)
        layout.addLayout(row)
        self.state = QLabel(NOTHING_TRIED)
        self.state.setObjectName("faint")
        self.state.setWordWrap(True)
        layout.addWidget(self.state)

    def show_scenario(self) -> None:
        """Show the faults of the text; what has not changed keeps its widgets and focus."""
        lines = faults_of(self._editing.text, more=tuple(self._bench.offered.faults))
        found = {(line.name, line.index): line for line in lines}
        for key in found:
            if key not in self._rows:
                self._row(*key)
        try:
            people = tuple(person.person_id for person in self._editing.scenario.people)
        except ValueError:  # said where the text is
            return
        for key, row in self._rows.items():
            row.show_line(found.get(key), objects=self._objects(), people=people)
        if self._live.isChecked() and self._editing.text != self._tried:
            self._debounce.start(DEBOUNCE_MS)
        self._show_state()

    def forget(self) -> None:
        """Another document: what was tried with the one before says nothing of it."""
        self._debounce.stop()
        self.trials.cancel()
        self._now = self._before = None
        self._tried = ""
        self.bars.hide()
        self._start.setText("Try now")
        self._show_state()

    def try_now(self) -> None:
        """Begin a trial of the text as it is now."""
        document = self._bench.document
        self._tried = self._editing.text
        if self._now is not None and self._now.errors and self._now.is_done:
            self._before = self._now
        self._now = None
        self.state.setText("◌ rehearsing the first seconds …")
        seconds = float(self._length.currentData())
        more, arranged = self._editing.more_faults, arranged_text(document.twin)
        plan = TrialPlan(document.scene, self._tried, document.seed, seconds, more, arranged)
        self.trials.start(plan)
        self._start.setText("Stop")

    def take_results(self) -> None:
        """Show what the trial has come to."""
        result = self.trials.results.take()
        if result is None or not self._tried:  # of the document before, which is gone
            return
        self._now = result
        before = {} if self._before is None else self._before.errors
        self._show_state()
        if result.errors:
            self.bars.show_errors(result.errors, before)
            self.bars.show()
        if result.is_done:
            self._start.setText("Try now")

    def _show_state(self) -> None:
        """Show the faults that the figures are of, and whether the scenario still has them."""
        result = self._now
        if not self._tried:
            self.state.setText(NOTHING_TRIED)
        elif result is None:
            return
        elif result.problem:
            self.state.setText(f"✖ {result.problem}")
        elif not result.is_done:
            self.state.setText(f"◌ rehearsing … {result.share:.0%}")
        elif self._editing.text != self._tried:
            self.state.setText(CHANGED_SINCE)
        else:
            has_before = self._before is not None and bool(self._before.errors)
            tail = "; the line is the trial before" if has_before else "; faint names did not move"
            self.state.setText(f"● mean errors{tail}")
        is_old = result is not None and self._editing.text != self._tried
        self.bars.setEnabled(not is_old)

    def close_trials(self) -> None:
        """Stop what plays: the window closes."""
        self._poll.stop()
        self._debounce.stop()
        self.trials.close()

    def _on_button(self) -> None:
        if self._start.text() == "Stop":
            self.trials.cancel()
            self.state.setText("○ stopped")
            self._start.setText("Try now")
        else:
            self.try_now()

    def close_knobs(self) -> None:
        """No longer follow the bench, and stop what plays: the window closes."""
        self._bench.stop_listening(self._on_offered)
        self._bench.stop_listening(self.forget)
        self.close_trials()

    def _on_offered(self) -> None:
        """Plug-ins offer other faults: theirs are made anew."""
        for key in [key for key in self._rows if key[0] not in FAULT_FIELDS]:
            row = self._rows.pop(key)
            row.hide()
            row.deleteLater()
        for name in self._bench.offered.faults:
            self._row(name, 0)
        self.show_scenario()

    def _row(self, name: str, index: int) -> FaultRow:
        known = fault_fields(self._bench.offered.faults)
        row = FaultRow(self._bench, name, index, title=title_of(name), fields=known[name])
        order = list(known)
        place = order.index(name), index
        before = [key for key in self._rows if (order.index(key[0]), key[1]) < place]
        self._rows[name, index] = row
        self._list.insertWidget(len(before), row)
        return row
