"""The scenario dock: floor, actions, faults and text of one scenario."""

from __future__ import annotations

from functools import partial
from typing import Any

from PySide6.QtCore import QTimer
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from sim.scenarios.actions import name_of
from sim.scenarios.scenario import Scenario, scenario_names
from studio.app.model.names import distinct_names
from studio.app.model.workbench import Topic, Workbench
from studio.app.scenario.action_blocks import ActionBlocks, Key
from studio.app.scenario.action_form import ActionForm
from studio.app.scenario.faults.knobs import FaultKnobs
from studio.app.scenario.fields import ACTION_FIELDS, Field
from studio.app.scenario.floor.backdrop import BackdropJob
from studio.app.scenario.floor.view import FloorPlan
from studio.app.scenario.form import Number
from studio.app.scenario.plan import Block, RoomPlan, planned, room_plan
from studio.app.scenario.scenario_actions import ScenarioActions
from studio.app.scenario.text.editing import ScenarioEditing
from studio.app.scenario.text.editor import ScenarioText
from studio.app.shell.questions import ask_file
from studio.app.shell.wrapping import WrappingRow, together

POLL_MS = 60
DURATION = Field("s", "length", unit="s", low=0.1, high=3600.0, usual=10.0)
FPS = Field("fps", "pictures", unit="/s", low=0.5, high=120.0, usual=10.0)
FACING = Field("facing_deg", "camera faces", unit="°", low=-360.0, high=360.0, usual=90.0)


class ScenarioDock(QWidget):
    """The scenario editor.

    Args:
        bench: whose document holds the scenario.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.editing = ScenarioEditing(bench)
        bench.share(self.editing)
        self._plan: RoomPlan | None = None
        self._blocks: tuple[Block, ...] = ()
        self._planned: tuple[Scenario, RoomPlan] | None = None
        self._job: BackdropJob | None = None
        self._pictured = ""
        """The scene that the floor's picture is of."""
        ScenarioActions(self.editing, partial(ask_file, self), self.object_ids)
        self.floor = FloorPlan(bench)
        self.blocks = ActionBlocks(bench, self.edit_action)
        self.form = ActionForm(bench, self.editing, self.object_ids)
        self.knobs = FaultKnobs(bench, self.editing, self.object_ids)
        self.text = ScenarioText(self.editing.type)
        self._make_layout()
        self.editing.listen(self._refresh)
        bench.listen(Topic.SCENE, self._on_scene)
        bench.listen(Topic.SETTINGS, self._refresh)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._take)
        self._timer.start(POLL_MS)
        self._on_scene()
        self._refresh()

    def object_ids(self) -> tuple[str, ...]:
        """Ids of the room's objects."""
        return () if self._plan is None else tuple(item.object_id for item in self._plan.items)

    # --- layout ----------------------------------------------------------------------------------

    def _make_layout(self) -> None:
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(self._make_top())
        self.problem = QLabel()
        self.problem.setWordWrap(True)
        self.problem.setContentsMargins(8, 2, 8, 4)
        self._discard = QPushButton("Go back to the last good text")
        self._discard.clicked.connect(lambda: self._bench.do("scenario.discard"))
        layout.addWidget(self.problem)
        layout.addWidget(self._discard)
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        self._pages = (self._make_floor(), self._make_actions(), self.knobs)
        for title, page in zip(("Floor", "Actions", "Faults"), self._pages, strict=True):
            self.tabs.addTab(page, title)
        self.tabs.addTab(self.text, "Text")
        self.tabs.currentChanged.connect(lambda _: self._refresh())
        layout.addWidget(self.tabs, 1)

    def _make_top(self) -> QHBoxLayout:
        self._choice = QComboBox()
        self._choice.setAccessibleName("Scenario")
        _narrow(self._choice)
        self._choice.textActivated.connect(self._choose)
        row = QHBoxLayout()
        row.setContentsMargins(8, 8, 8, 4)
        row.addWidget(self._choice, 1)
        for title, action in (("Open …", "scenario.open"), ("Save …", "scenario.save")):
            button = QPushButton(title)
            button.clicked.connect(lambda _=False, a=action: self._bench.do(a))
            row.addWidget(button)
        return row

    def _make_floor(self) -> QWidget:
        self._person = QComboBox()
        _narrow(self._person)
        self._person.setAccessibleName("Person whose goals are shown")
        self._person.activated.connect(lambda _: self._refresh())
        facing = Field("deg", "faces", unit="°", low=-360.0, high=360.0, usual=0.0)
        self._facing = Number(facing, 0.0, self._face)
        add, remove = QPushButton("Add"), QPushButton("Remove")
        add.setToolTip("Add a person in the middle of the room")
        add.clicked.connect(self._add_person)
        remove.setToolTip("Remove the person who is chosen")
        remove.clicked.connect(self._remove_person)
        self._person.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        top = WrappingRow((self._person, together(QLabel("faces"), self._facing), add, remove))
        self._length = Number(DURATION, 10.0, lambda _, v: self._bench.do("scenario.duration", s=v))
        self._fps = Number(FPS, 10.0, self._camera)
        self._camera_facing = Number(FACING, 90.0, self._camera)
        bottom = WrappingRow()
        for title, widget in (
            ("Length", self._length),
            ("Pictures", self._fps),
            ("Camera faces", self._camera_facing),
        ):
            bottom.addWidget(together(QLabel(title), widget))
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.addLayout(top)
        layout.addWidget(self.floor, 1)
        words = QLabel("Drag people and their arrows, goals, the camera, live surfaces.")
        words.setObjectName("faint")
        words.setWordWrap(True)
        layout.addWidget(words)
        layout.addLayout(bottom)
        # Tabs do not ask how high wrapped rows are in a width; what scrolls does.
        scroll = QScrollArea()
        scroll.setWidget(page)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QScrollArea.Shape.NoFrame)
        return scroll

    def _make_actions(self) -> QWidget:
        self._add_action = QComboBox()
        _narrow(self._add_action)
        self._add_action.addItem("Add an action …")
        self._add_action.addItems([name.replace("_", " ") for name in ACTION_FIELDS])
        self._add_action.activated.connect(self._on_add_action)
        self._hint = QLabel("Drag to reorder, double-click to change. Times are estimates.")
        self._hint.setWordWrap(True)
        self._hint.setObjectName("faint")
        scroll = QScrollArea()
        scroll.setWidget(self.blocks)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QScrollArea.Shape.NoFrame)
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.addWidget(self._add_action)
        layout.addWidget(scroll, 1)
        layout.addWidget(self.form, 2)
        layout.addWidget(self._hint)
        return page

    def heightForWidth(self, arg__1: int) -> int:
        """See Qt: what scrolls inside gives way, or the dock would scroll as a whole, too."""
        return self.minimumSizeHint().height()

    # --- what changes ----------------------------------------------------------------------------

    def _on_scene(self) -> None:
        scene, name = self._bench.scene, self._bench.document.scene
        if name != self._pictured:
            # A session opens its scene anew; of the same room, the picture stays until it is there.
            self._pictured = name
            self.floor.set_picture(None, 0.0)
        if scene is None:
            self._plan, self._job = None, None
        elif self._job is None or self._job.scene is not scene:
            self._plan = room_plan(scene, None)
            self._job = BackdropJob(scene, name)
        self._refresh()

    def _take(self) -> None:
        found = None if self._job is None else self._job.take()
        if found is None or found.scene is not self._bench.scene:
            return
        if found.plan is not None:
            self._plan = found.plan
        if found.picture is not None:
            self.floor.set_picture(found.picture, found.extent_m)
        if found.problem:
            self._bench.say("warning", f"floor plan: {found.problem}")
        if found.first_text:
            self.editing.set_first_text(found.first_text)
        self._refresh()

    def _refresh(self) -> None:
        editing = self.editing
        self._show_problem()
        self.text.show_text(
            editing.text if editing.draft is None else editing.draft, editing.error_line
        )
        try:
            scenario = editing.scenario
        except ValueError as error:  # a project that was saved by another program
            self.problem.setText(f"✖ {error}")
            self.problem.show()
            return
        self._show_names()
        people = tuple(person.person_id for person in scenario.people)
        self._show_people(people)
        for number, value in (
            (self._length, scenario.duration_s),
            (self._fps, scenario.camera.fps),
            (self._camera_facing, scenario.camera.facing_deg),
        ):
            _set(number, value)
        if self._plan is not None:
            if self._planned != (scenario, self._plan):
                self._blocks = planned(scenario, self._plan)
                self._planned = (scenario, self._plan)
            if self.tabs.currentIndex() == 0:
                self.floor.show_plan(scenario, self._plan, self._blocks, self._chosen_person())
        self.blocks.show_blocks(people, self._blocks, scenario.duration_s)
        self.knobs.show_scenario()
        self.form.refresh()
        self._hint.setVisible(self.form.widget is None)

    def _show_problem(self) -> None:
        problem = self.editing.problem
        self.problem.setText(f"✖ {problem}\nRehearsed is the last good text." if problem else "")
        self.problem.setVisible(bool(problem))
        self._discard.setVisible(bool(problem))
        for page in self._pages:
            page.setEnabled(not problem)

    def _show_names(self) -> None:
        names = list(scenario_names())
        if self.editing.name not in names:
            names.insert(0, self.editing.name)
        if [self._choice.itemText(k) for k in range(self._choice.count())] != names:
            self._choice.clear()
            self._choice.addItems(names)
        self._choice.setCurrentText(self.editing.name)

    def _show_people(self, people: tuple[str, ...]) -> None:
        box = self._person
        wanted = [
            ("Everybody", ""),
            *zip(distinct_names(people, self._bench.name_of), people, strict=True),
        ]
        if [(box.itemText(k), box.itemData(k)) for k in range(box.count())] != wanted:
            chosen = box.currentData()
            box.clear()
            for words, person_id in wanted:
                box.addItem(words, person_id)
            box.setCurrentIndex(max(box.findData(chosen), 0))
        person = self._chosen_person() or (people[0] if len(people) == 1 else "")
        self._facing.setEnabled(bool(person))
        found = [p for p in self.editing.scenario.people if p.person_id == person]
        if found:
            _set(self._facing, found[0].facing_deg)

    def _chosen_person(self) -> str:
        return str(self._person.currentData() or "")

    def _one_person(self) -> str:
        """The person who is chosen, or the only one."""
        people = self.editing.scenario.people
        return self._chosen_person() or (people[0].person_id if people else "")

    # --- what is asked for -----------------------------------------------------------------------

    def edit_action(self, key: Key | None) -> None:
        """Open the form of an action below the blocks; None closes it."""
        self.form.edit(key)
        self._hint.setVisible(self.form.widget is None)

    def _on_add_action(self, row: int) -> None:
        self._add_action.setCurrentIndex(0)
        selected = self.blocks.selected
        person = selected[0] if selected is not None else self._one_person()
        if row > 0 and person:
            do = list(ACTION_FIELDS)[row - 1]
            values: dict[str, Any] = {"person": person, "do": do}
            if selected is not None:
                values["index"] = selected[1] + 1
            if self._bench.do("scenario.add_action", **values):
                people = {p.person_id: p for p in self.editing.scenario.people}
                count = len(people[person].actions)
                key = (person, values.get("index", count - 1))
                self.blocks.selected = key
                assert name_of(people[person].actions[key[1]]) == do
                self.edit_action(key)

    def _add_person(self) -> None:
        plan = self._plan
        x, y = (0.0, 0.0)
        if plan is not None:
            x, y = (0.5 * (a + b) for a, b in zip(plan.low, plan.high, strict=True))
        if plan is not None and plan.floor is not None:
            import numpy as np

            x, y = (float(v) for v in plan.floor.bare.nearest_free(np.array([x, y])))
        self._bench.do("scenario.add_person", x=round(x, 2), y=round(y, 2))

    def _remove_person(self) -> None:
        person = self._chosen_person()
        if person:
            self._bench.do("scenario.remove_person", id=person)
        else:
            self._bench.say("info", "choose the person to remove in the list beside the button")

    def _face(self, _: str, value: Any) -> None:
        person = self._one_person()
        if person:
            self._bench.do("scenario.face_person", id=person, deg=value)

    def _camera(self, key: str, value: Any) -> None:
        self._bench.do("scenario.camera", key=key, value=value)

    def _choose(self, name: str) -> None:
        if name in scenario_names():
            self._bench.do("scenario.choose", name=name)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop what runs in the background."""
        self._timer.stop()
        self.knobs.close_knobs()
        self.editing.close()
        self._bench.stop_listening(self._on_scene)
        self._bench.stop_listening(self._refresh)
        event.accept()


def _narrow(box: QComboBox) -> None:
    """Let a list be narrower than its longest entry, which it shows when it is open."""
    box.setMinimumContentsLength(8)
    box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)


def _set(number: Number, value: float) -> None:
    """Show a value without calling it a change, unless one is being typed there."""
    is_typed = number.hasFocus() and number.lineEdit().isModified()
    if not is_typed and number.value() != value:
        number.blockSignals(True)
        number.setValue(value)
        number.blockSignals(False)
