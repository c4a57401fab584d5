"""The tracker of the next session and its settings: changed, tried beside one, applied."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.workbench import Topic, Workbench
from tracking.options import SEARCH_MS_RANGE, TrackerOptions

if TYPE_CHECKING:  # a session takes a second to import
    from scenes.pose import Pose
    from studio.session.session import SessionOutput

TITLES: Mapping[str, tuple[str, str]] = {
    "calibrate": (
        "refine the camera's pose",
        "on the room's splats, from the next time that the camera moves",
    ),
    "texture": ("use colours inside outlines", "as well as the outlines themselves"),
    "recover": ("look for lost objects", "off: a lost object stays lost"),
    "search_ms": (
        "looking for them, at most",
        "time of a rehearsed frame; more finds them sooner",
    ),
}
"""Title and hint of each setting."""

AS_IT_IS = "Change a setting and try it: the session goes on as it is."


class TrackerOptionsForm(QWidget):
    """The settings as they would be; only *Apply* changes the document.

    Args:
        bench: whose document has them.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self._shown = bench.document.tracker.options
        self.boxes: dict[str, QCheckBox] = {}
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(3)
        for field in fields(TrackerOptions):
            title, hint = TITLES[field.name]
            if field.name == "search_ms":
                layout.addLayout(self._make_number(title, hint))
                continue
            box = QCheckBox(title)
            box.setToolTip(hint)
            box.clicked.connect(self._changed)
            self.boxes[field.name] = box
            layout.addWidget(box)
        self.line = QLabel(AS_IT_IS)
        self.line.setWordWrap(True)
        layout.addWidget(self.line)
        layout.addLayout(self._make_buttons())
        bench.listen(Topic.DOCUMENT, self.refresh)
        bench.listen(Topic.SESSION, self.show_trial)
        self._fill(self._shown)
        self.show_trial()

    def _make_number(self, title: str, hint: str) -> QHBoxLayout:
        self.search_ms = QDoubleSpinBox()
        self.search_ms.setRange(*SEARCH_MS_RANGE)
        self.search_ms.setDecimals(0)
        self.search_ms.setSuffix(" ms")
        self.search_ms.setToolTip(hint)
        self.search_ms.setAccessibleName(title)
        self.search_ms.setKeyboardTracking(False)
        self.search_ms.valueChanged.connect(self._changed)
        row = QHBoxLayout()
        row.addWidget(QLabel(title), 1)
        row.addWidget(self.search_ms)
        return row

    def _make_buttons(self) -> QHBoxLayout:
        self.trying = QPushButton("Try")
        self.trying.setCheckable(True)
        self.trying.setToolTip("track with these beside the session that plays, and compare")
        self.trying.clicked.connect(self._try)
        self.apply = QPushButton("Apply")
        self.apply.setToolTip("from the next frame on; undo goes back, and both are recorded")
        self.apply.clicked.connect(self._apply)
        self.reset = QPushButton("Reset")
        self.reset.setToolTip("show the settings that hold")
        self.reset.clicked.connect(self._reset)
        row = QHBoxLayout()
        for button in (self.trying, self.apply, self.reset):
            row.addWidget(button)
        row.addStretch(1)
        return row

    @property
    def options(self) -> TrackerOptions:
        """As the form has them."""
        values = {name: box.isChecked() for name, box in self.boxes.items()}
        return TrackerOptions(**values, search_ms=self.search_ms.value())

    def refresh(self) -> None:
        """Follow the document where it was changed elsewhere, by undo say."""
        now = self._bench.document.tracker.options
        if now != self._shown:
            self._shown = now
            self._fill(now)
        self._enable()

    def show_trial(self) -> None:
        """Say what the trial gives, beside what the session has."""
        run = self._bench.session
        is_tried = run is not None and run.trying is not None
        output = None if run is None else run.output
        self.trying.setChecked(is_tried)
        self.trying.setText("End trying" if is_tried else "Try")
        if not is_tried:
            self.line.setText(AS_IT_IS)
        elif output is not None and output.trial is not None:
            self.line.setText(trial_words(output, self._bench.name_of))
        else:
            self.line.setText("◌ trying …")
        self._enable()

    def close_form(self) -> None:
        """No longer follow the bench."""
        self._bench.stop_listening(self.refresh)
        self._bench.stop_listening(self.show_trial)

    def _fill(self, options: TrackerOptions) -> None:
        for name, box in self.boxes.items():
            box.setChecked(getattr(options, name))
        self.search_ms.blockSignals(True)
        self.search_ms.setValue(options.search_ms)
        self.search_ms.blockSignals(False)

    def _enable(self) -> None:
        run = self._bench.session
        differs = self.options != self._bench.document.tracker.options
        self.apply.setEnabled(differs)
        self.reset.setEnabled(differs)
        self.trying.setEnabled(run is not None and run.is_playing)

    def _changed(self) -> None:
        if self.trying.isChecked():
            self._try(True)
        self._enable()

    def _try(self, is_on: bool) -> None:
        if is_on:
            self._bench.do("tracker.try", **self._values(self.options))
        else:
            self._bench.do("tracker.end_try")
        self.show_trial()

    def _apply(self) -> None:
        before = self._bench.document.tracker.options
        now = self._values(self.options)
        changed = {name: value for name, value in now.items() if value != getattr(before, name)}
        if changed and self._bench.do("tracker.set", **changed) and self.trying.isChecked():
            self._try(False)

    def _reset(self) -> None:
        self._fill(self._bench.document.tracker.options)
        self._changed()

    def _values(self, options: TrackerOptions) -> dict[str, bool | float]:
        return {field.name: getattr(options, field.name) for field in fields(options)}


def trial_words(output: SessionOutput, name: Callable[[str], str]) -> str:
    """How far apart the trial's poses and the session's are, and what either takes."""
    assert output.trial is not None
    found = {track.object_id: track for track in output.trial.objects}
    apart: list[tuple[float, str]] = []
    for track in output.shown.objects:
        other = found.get(track.object_id)
        if other is None:
            continue
        distance_cm, turned_deg = _apart(track.world_from_object, other.world_from_object)
        text = f"{name(track.object_id)} {distance_cm:.1f} cm, {turned_deg:.1f}°"
        if track.state != other.state:
            text += f", {other.state} instead of {track.state}"
        if track.state != other.state or distance_cm > 0.05 or turned_deg > 0.05:
            apart.append((distance_cm, text))
    farthest = [text for _, text in sorted(apart, reverse=True)[:3]]
    took, shown = (sum(each.stage_ns.values()) / 1e6 for each in (output.trial, output.shown))
    same = "every object as it is" if not farthest else "; ".join(farthest)
    return f"● tried: {same}. {took:.0f} ms for this frame instead of {shown:.0f} ms."


def _apart(a: Pose, b: Pose) -> tuple[float, float]:
    """Distance in cm and angle of yaw in degrees between two poses."""
    turned = (a.yaw() - b.yaw() + np.pi) % (2 * np.pi) - np.pi
    distance_m = float(np.linalg.norm(a.translation - b.translation))
    return 100 * distance_m, abs(float(np.degrees(turned)))


TRACKER_TITLES = {"own": "this program's", "paper": "the paper's"}
"""Titles of the built-in trackers."""


class TrackerPanel(QWidget):
    """The choice of the tracker.

    Args:
        bench: whose document has it.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.names = QComboBox()
        self.names.setAccessibleName("Tracker of the next session")
        self.names.activated.connect(self._choose)
        self.beside = QCheckBox("this program's too")
        self.beside.setToolTip("run this program's tracker too: report and timeline show both")
        self.beside.clicked.connect(self._choose)
        self.note = QLabel()
        self.note.setWordWrap(True)
        row = QHBoxLayout()
        row.addWidget(QLabel("Tracker"))
        row.addWidget(self.names, 1)
        row.addWidget(self.beside)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(row)
        layout.addWidget(self.note)
        self.options = TrackerOptionsForm(bench)
        layout.addWidget(self.options)
        bench.listen(Topic.DOCUMENT, self.refresh)
        bench.listen(Topic.OFFERED, self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the trackers that there are, and the one that is chosen."""
        choice, offered = self._bench.document.tracker, self._bench.offered.trackers
        known = [*TRACKER_TITLES, *offered]
        is_missing = choice.name not in known
        names = [*known, choice.name] if is_missing else known
        if [self.names.itemData(row) for row in range(self.names.count())] != names:
            self.names.clear()
            for name in names:
                self.names.addItem(TRACKER_TITLES.get(name, f"{name} (plug-in)"), name)
        self.names.setCurrentIndex(names.index(choice.name))
        self.beside.setChecked(choice.is_beside)
        self.beside.setEnabled(choice.name != "own")
        self.options.setVisible(choice.name == "own" or choice.is_beside)
        self.note.setText(f"▲ no plug-in offers {choice.name!r} now" if is_missing else "")
        self.note.setVisible(is_missing)

    def close_panel(self) -> None:
        """No longer follow the bench."""
        self._bench.stop_listening(self.refresh)
        self.options.close_form()

    def _choose(self) -> None:
        values = {"name": self.names.currentData(), "beside": self.beside.isChecked()}
        if not self._bench.do("tracker.choose", **values):
            self.refresh()
