"""The page on which the open room gets its scale: the measured line, and how long it is really."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QTimer, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QDoubleSpinBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.measured_line import MeasuredLine
from studio.app.model.workbench import Topic, Workbench
from studio.app.preparation.preparation_job import PreparationJob, rescaling_words
from studio.app.preparation.stage_lines import StageLine
from studio.app.shell.theme import SHAPES

WHAT = (
    "Is the open room too large or too small? Click both ends of something whose length you know, "
    "and say how long it is really. A new scene is made; this one stays as it is."
)
UNKNOWN_UNIT = (
    "{name} does not say how long its unit is: one unit is shown as one metre. Measure something "
    "whose length you know, or make a room of it by the height of its ceiling."
)
MAKE_ROOM, MEASURE = "Make a room of it", "Measure something"
"""Words on the buttons of that."""
NOT_MEASURED = "Nothing is measured in this room yet."
CANCELLED = "cancelled: the room keeps its scale"
OPEN_IT = ": open it when what you have changed meanwhile is saved"
BUILT_IN = "The scale of built-in rooms is exact."
MAX_M = 1000.0
"""Metres, of the longest length that can be typed: a street."""
POLL_MS = 200


class ScalePage(QWidget):
    """Tool, measured line, true length, what came of it.

    Args:
        bench: has what was measured, and opens the scene that is made.
    """

    asked = Signal()
    """Somebody wants to see this page."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.job: PreparationJob | None = None
        self._scaled = ""
        what = QLabel(WHAT)
        what.setObjectName("faint")
        what.setWordWrap(True)
        self.tool_button = QPushButton("Measure in the view")
        self.tool_button.clicked.connect(lambda: bench.do("view.tool_measure"))
        self.line = QLabel()
        self.line.setWordWrap(True)
        self.metres = QDoubleSpinBox()
        self.metres.setAccessibleName("True length")
        self.metres.setRange(0.0, MAX_M)
        self.metres.setDecimals(3)
        self.metres.setSingleStep(0.01)
        self.metres.setSuffix(" m")
        self.button, self.cancel_button = QPushButton("Set the scale"), QPushButton("Cancel")
        self.button.clicked.connect(
            lambda: bench.do("preparation.set_scale", metres=round(self.metres.value(), 3))
        )
        self.cancel_button.clicked.connect(self.cancel)
        self.verdict = QLabel()
        self.verdict.setWordWrap(True)
        form = QFormLayout()
        form.setRowWrapPolicy(QFormLayout.RowWrapPolicy.WrapLongRows)
        form.addRow(self.tool_button, self.line)
        form.addRow("It is really", self.metres)
        buttons = QHBoxLayout()
        buttons.addWidget(self.button, 1)
        buttons.addWidget(self.cancel_button)
        layout = QVBoxLayout(self)
        layout.addWidget(what)
        layout.addLayout(form)
        layout.addLayout(buttons)
        layout.addWidget(self.verdict)
        layout.addStretch(1)
        bench.listen(Topic.SCENE, self._on_scene)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(POLL_MS)
        self.refresh()

    def begin(self, metres: float) -> None:
        """Make a scene of the open one in which the measured line has its true length.

        Args:
            metres: how long the line is really.

        Raises:
            ValueError: nothing was measured in the open room, a length is not positive, a scene is
                being made already, or what was changed by hand would be lost.
        """
        if self.job is not None:
            raise ValueError("a scene is being scaled: wait for it, or cancel it")
        line = self._measured()
        if line is None:
            raise ValueError("nothing was measured in this room: take Measure (key 4), click twice")
        if not self._bench.is_saved:
            raise ValueError("the scaled room opens as a new project: save this one first (Ctrl+S)")
        self.job = PreparationJob(*rescaling_words(line, float(metres)))
        self._scaled = line.scene
        self.refresh()

    def cancel(self) -> None:
        """Ask what runs to end; the room keeps its scale."""
        if self.job is not None:
            self.job.cancel()

    def refresh(self) -> None:
        """Show what was measured last, and how far a scene is that is being made."""
        line, job = self._measured(), self.job
        text = NOT_MEASURED if line is None else f"{line.length_m:.3f} m"
        is_built_in = not Path(self._bench.document.scene).exists()
        text = BUILT_IN if is_built_in else text
        if text != self.line.text():
            self.line.setText(text)
        can_begin = line is not None and not is_built_in and job is None
        self.metres.setEnabled(can_begin)
        self.button.setEnabled(can_begin and self.metres.value() > 0)
        self.cancel_button.setEnabled(job is not None)
        if job is None:
            return
        if job.is_running:
            self.verdict.setText(_progress(job.stages))
            return
        self.job = None
        self._end(job)

    def _measured(self) -> MeasuredLine | None:
        line = self._bench.shared(MeasuredLine)
        return None if line is None or line.scene != self._bench.document.scene else line

    def _end(self, job: PreparationJob) -> None:
        bench = self._bench
        if job.problem.startswith("cancelled"):
            self.verdict.setText(f"{SHAPES['warning']} {CANCELLED}")
            bench.say("warning", CANCELLED)
            return
        if job.problem:
            self.verdict.setText(f"{SHAPES['bad']} {job.problem}")
            bench.say("error", job.problem)
            return
        ready = f"{job.out.name} is ready"
        # What was done by hand meanwhile is not taken from the user's sight.
        is_free = bench.is_saved and bench.document.scene == self._scaled
        self.verdict.setText(f"{SHAPES['good']} {ready}{'' if is_free else OPEN_IT}")
        bench.say("info", f"{ready}: {job.out}")
        if is_free and "file.open_scene" in bench.actions:
            bench.do("file.open_scene", scene=str(job.out))

    def _on_scene(self) -> None:
        path = Path(self._bench.document.scene)
        if self._bench.scene is None or not path.is_file():
            return
        from scenes.formats.registry import is_in_world_frame

        if not is_in_world_frame(path):
            words = UNKNOWN_UNIT.format(name=path.name)
            self._bench.say("warning", words)
            ways = {MEASURE: self._measure, MAKE_ROOM: self._make_room}
            self._bench.notify(words, "warning", ways)

    def _measure(self) -> None:
        """Take the tool, and come to the front."""
        bench = self._bench
        bench.do("dock.preparation")
        self.asked.emit()
        bench.do("view.tool_measure")

    def _make_room(self) -> None:
        self._bench.do("preparation.room_of", path=self._bench.document.scene)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End what runs, and stop following the bench."""
        self._timer.stop()
        self._bench.stop_listening(self._on_scene)
        self.cancel()
        event.accept()


def _progress(stages: tuple[StageLine, ...]) -> str:
    if not stages:
        return "beginning …"
    stage = stages[-1]
    left = "" if stage.left_s is None else f", {stage.left_s:.0f} s left"
    return f"{stage.name} … {100 * stage.done:.0f} %{left}"
