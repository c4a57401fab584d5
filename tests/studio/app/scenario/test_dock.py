"""The dock with a mouse, and trials in the background."""

import time

import pytest

from scenes.opening import open_scene
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench

pytestmark = pytest.mark.gui


@pytest.fixture
def dock(qtbot):
    from studio.app.scenario.dock import ScenarioDock
    from studio.app.shell.history import QtHistory

    benches = []
    history = QtHistory(lambda document: benches[0].show_document(document))
    bench = Workbench(Document("lab"), Settings(), history)
    benches.append(bench)
    made = ScenarioDock(bench)
    made.resize(420, 700)
    made.show()
    bench.show_scene(open_scene("lab"))
    qtbot.waitUntil(
        lambda: made._plan is not None and made._plan.floor is not None, timeout=120_000
    )
    yield made
    made.close()
    made.deleteLater()


def scenario(dock):
    return dock.editing.scenario


def test_a_person_is_dragged_in_one_step_of_undo(dock, qtbot):
    from PySide6.QtCore import QPoint, Qt

    from studio.app.scenario.floor.view import to_scene

    view, bench = dock.floor, dock._bench
    x, y = scenario(dock).people[0].start
    start = view.mapFromScene(to_scene(x, y))
    qtbot.mousePress(view.viewport(), Qt.MouseButton.LeftButton, pos=start)
    for k in range(1, 6):
        qtbot.mouseMove(view.viewport(), start + QPoint(4 * k, 3 * k))
    end = start + QPoint(20, 15)
    qtbot.mouseRelease(view.viewport(), Qt.MouseButton.LeftButton, pos=end)
    moved = scenario(dock).people[0].start
    wanted = view.mapToScene(end) - view.mapToScene(start)
    assert moved[0] == pytest.approx(x + wanted.x() / 100, abs=0.03)
    assert moved[1] == pytest.approx(y - wanted.y() / 100, abs=0.03)
    assert "move_person" in bench.trace()[-1]
    bench.history.undo()
    assert scenario(dock).people[0].start == (x, y)


def drag(dock, qtbot, start, end):
    """Drag on the floor plan, from and to (x, y) in metres."""
    from PySide6.QtCore import Qt

    from studio.app.scenario.floor.view import to_scene

    view = dock.floor
    first, last = (view.mapFromScene(to_scene(*place)) for place in (start, end))
    qtbot.mousePress(view.viewport(), Qt.MouseButton.LeftButton, pos=first)
    for k in range(1, 6):
        qtbot.mouseMove(view.viewport(), first + (last - first) * k / 5)
    qtbot.mouseRelease(view.viewport(), Qt.MouseButton.LeftButton, pos=last)


def test_a_person_is_turned_by_the_tip_of_the_arrow(dock, qtbot):
    import math

    from studio.app.scenario.floor.view import NOSE_SHARE, PERSON_M

    person = scenario(dock).people[0]
    (x, y), reach = person.start, NOSE_SHARE * PERSON_M
    turn = math.radians(person.facing_deg)
    drag(dock, qtbot, (x + reach * math.cos(turn), y + reach * math.sin(turn)), (x + 0.6, y))
    assert scenario(dock).people[0].facing_deg == pytest.approx(0.0, abs=3.0)
    assert scenario(dock).people[0].start == (x, y)
    dock._bench.history.undo()
    assert scenario(dock).people[0].facing_deg == person.facing_deg


def test_a_person_who_is_dragged_takes_along_name_and_way(dock, qtbot):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtWidgets import QGraphicsPathItem, QGraphicsSimpleTextItem

    from studio.app.scenario.floor.handle import to_scene

    view, person = dock.floor, dock.editing.scenario.people[0]
    name = dock._bench.name_of(person.person_id)

    def seen():
        items = view.scene().items()
        label = next(
            i for i in items if isinstance(i, QGraphicsSimpleTextItem) and i.text() == name
        )
        ways = [i for i in items if isinstance(i, QGraphicsPathItem) and i.parentItem() is None]
        starts = [way.path().elementAt(0) for way in ways if way.path().elementCount() > 1]
        return label.pos(), {(round(s.x), round(s.y)) for s in starts}

    place = to_scene(*person.start)
    start = view.mapFromScene(place)
    label, ways = seen()
    assert (round(place.x()), round(place.y())) in ways
    qtbot.mousePress(view.viewport(), Qt.MouseButton.LeftButton, pos=start)
    for step in (5, 12, 20):
        qtbot.mouseMove(view.viewport(), start + QPoint(step, step))
    moved, ways = seen()  # before it is let go
    at = view.mapToScene(start + QPoint(20, 20))
    assert moved.x() - label.x() == pytest.approx(at.x() - place.x(), abs=3)
    assert any(abs(x - at.x()) < 3 and abs(y - at.y()) < 3 for x, y in ways)
    qtbot.mouseRelease(view.viewport(), Qt.MouseButton.LeftButton, pos=start + QPoint(20, 20))


@pytest.mark.parametrize("part", ["left", "whole"])
def test_a_live_surface_is_dragged_on_the_floor(dock, qtbot, part):
    from studio.app.scenario.floor.view import middle_of

    before = scenario(dock).surfaces[1].corners_in_world
    x, y = middle_of(before, part)
    drag(dock, qtbot, (x, y), (x - 0.2, y - 0.3))
    after = scenario(dock).surfaces[1].corners_in_world
    moved = {"left": (0, 3), "whole": (0, 1, 2, 3)}[part]
    for k in range(4):
        by = (-0.2, -0.3, 0.0) if k in moved else (0.0, 0.0, 0.0)
        wanted = [a + b for a, b in zip(before[k], by, strict=True)]
        assert after[k] == pytest.approx(wanted, abs=0.03)
    dock._bench.history.undo()
    assert scenario(dock).surfaces[1].corners_in_world == before


@pytest.mark.parametrize("field", ["_length", "_facing", "_fps", "_camera_facing"])
def test_steps_of_a_number_in_a_row_are_one_step_of_undo(dock, qtbot, field):
    from PySide6.QtCore import Qt
    from PySide6.QtWidgets import QApplication

    number, text, value = getattr(dock, field), dock.editing.text, getattr(dock, field).value()
    QApplication.setActiveWindow(dock)  # Xvfb has no window manager that would
    number.setFocus()
    assert number.hasFocus()
    for _ in range(4):
        qtbot.keyClick(number, Qt.Key.Key_Up)
    assert number.value() > value
    assert dock.editing.text != text
    dock._bench.history.undo()
    assert dock.editing.text == text
    assert number.value() == value


def test_steps_of_an_actions_number_are_one_step_of_undo(dock, qtbot):
    from PySide6.QtCore import Qt
    from PySide6.QtWidgets import QDoubleSpinBox

    dock.tabs.setCurrentIndex(1)
    dock.edit_action(("local-user", 0))
    text = dock.editing.text
    number = dock.form.widget.findChild(QDoubleSpinBox)
    number.setFocus()
    for _ in range(4):
        qtbot.keyClick(number, Qt.Key.Key_Up)
    assert scenario(dock).people[0].actions[0].seconds == pytest.approx(4.5)
    dock._bench.history.undo()
    assert dock.editing.text == text


def test_the_floors_picture_stays_while_the_same_room_is_opened_again(dock, qtbot):
    from dataclasses import replace

    bench = dock._bench
    qtbot.waitUntil(lambda: dock.floor._picture is not None, timeout=120_000)
    scene = bench.scene
    bench.show_scene(None)
    bench.show_scene(replace(scene))
    assert dock.floor._picture is not None
    bench.show_document(replace(bench.document, scene="desk"))
    bench.show_scene(None)
    assert dock.floor._picture is None


def test_blocks_are_dragged_removed_and_changed(dock, qtbot):
    from PySide6.QtCore import Qt

    dock.tabs.setCurrentIndex(1)
    blocks = dock.blocks
    before = scenario(dock).people[0].actions
    rects = blocks.block_rects()
    start = rects["local-user", 1].center().toPoint()
    end = rects["local-user", 2].center().toPoint()
    end.setX(end.x() + 6)
    qtbot.mousePress(blocks, Qt.MouseButton.LeftButton, pos=start)
    qtbot.mouseMove(blocks, end)
    qtbot.mouseRelease(blocks, Qt.MouseButton.LeftButton, pos=end)
    order = scenario(dock).people[0].actions
    assert order == (before[0], before[2], before[1], *before[3:])
    qtbot.keyClick(blocks, Qt.Key.Key_Delete)
    assert scenario(dock).people[0].actions == (before[0], before[2], *before[3:])
    at = blocks.block_rects()["local-user", 1].center().toPoint()
    qtbot.mouseDClick(blocks, Qt.MouseButton.LeftButton, pos=at)
    assert dock.form.widget is not None
    assert "push" in dock.form.title.text()


def test_every_kind_of_action_and_fault_can_be_added(dock):
    from studio.app.scenario.fields import ACTION_FIELDS, FAULT_FIELDS

    bench = dock._bench
    assert bench.do("scenario.add_person", id="ben", x=1.0, y=-1.5)
    for do in ACTION_FIELDS:
        assert bench.do("scenario.add_action", person="ben", do=do), do
        dock.edit_action(("ben", len(scenario(dock).people[-1].actions) - 1))
        assert dock.form.widget is not None
    for name in FAULT_FIELDS:
        assert bench.do("scenario.add_fault", name=name), name
    assert len(scenario(dock).people[-1].actions) == len(ACTION_FIELDS)
    assert bench.do("scenario.add_action", person="ben", do="point", at=[1, 2, 0.5], index=0)
    assert scenario(dock).people[-1].actions[0].at == (1.0, 2.0, 0.5)
    assert not bench.log.lines("warning")
    for name in FAULT_FIELDS:
        assert bench.do("scenario.remove_fault", name=name)
    assert not dock._bench.do("scenario.set_fault", name="fog", field="px", value=1.0)


def test_a_remote_path_is_drawn_on_the_floor(dock):
    bench, text = dock._bench, dock.editing.text
    assert bench.do("scenario.add_remote_point", id="remote-user", index=1, x=0.5, y=-1.0)
    assert scenario(dock).remote[0].path[1] == (0.5, -1.0, 1.6)
    assert bench.do("scenario.move_remote_point", id="remote-user", index=1, x=0.75, y=-1.25)
    assert scenario(dock).remote[0].path[1] == (0.75, -1.25, 1.6)
    assert bench.do("scenario.remove_remote_point", id="remote-user", index=1)
    assert dock.editing.text == text


def test_a_slider_is_one_step(dock):
    bench = dock._bench
    bench.do("scenario.add_fault", name="blur")
    text = dock.editing.text
    for px in (2.5, 3.0, 4.5):
        assert bench.do("scenario.set_fault", name="blur", field="px", value=px)
    bench.history.undo()
    assert dock.editing.text == text


def test_typing_shows_what_is_wrong_and_loses_nothing(dock, qtbot):
    dock.tabs.setCurrentIndex(3)
    good = dock.editing.text
    bad = good.replace("duration_s = 24.0", "duration_s = = 24")
    dock.text.setPlainText(bad)
    qtbot.waitUntil(lambda: dock.problem.isVisible(), timeout=60_000)
    assert "line 3" in dock.problem.text()
    assert dock.text.extraSelections()[0].cursor.blockNumber() == 2
    assert not dock._bench.do("scenario.duration", s=5.0)
    assert dock.text.toPlainText() == bad
    assert dock.editing.text == good
    assert dock._bench.do("scenario.discard")
    assert dock.text.toPlainText() == good


def test_a_trial_scores_the_tracker_and_a_newer_one_wins(dock, qtbot):
    knobs = dock.knobs
    dock._bench.do("scenario.choose", name="lab-short")
    dock._bench.do("scenario.duration", s=1.5)
    knobs.try_now()
    time.sleep(0.3)
    dock._bench.do("scenario.set_fault", name="blur", field="px", value=3.0)
    knobs.try_now()
    qtbot.waitUntil(lambda: knobs._now is not None and knobs._now.is_done, timeout=120000)
    assert not knobs._now.problem
    assert "chair-1" in knobs._now.errors
    assert 0.0 <= knobs._now.errors["chair-1"].position_cm < 50.0
    assert "blur" in knobs._tried


def boxes(widget):
    """What every list of a form offers: (words, ids)."""
    from PySide6.QtWidgets import QComboBox

    return [
        (
            [box.itemText(k) for k in range(box.count())],
            [box.itemData(k) for k in range(box.count())],
        )
        for box in widget.findChildren(QComboBox)
    ]


def test_forms_offer_names_and_write_ids(dock):
    from PySide6.QtWidgets import QComboBox

    bench, person = dock._bench, scenario(dock).people[0].person_id
    assert bench.do("scenario.add_action", person=person, do="receive", index=0)
    dock.edit_action((person, 0))
    ids = list(dock.object_ids())
    scanned = [item.name for item in bench.scene.objects]
    assert boxes(dock.form.widget) == [(scanned, ids)]
    box = dock.form.widget.findChild(QComboBox)
    box.setCurrentIndex(2)
    box.activated.emit(2)
    assert scenario(dock).people[0].actions[0].object == ids[2]
    assert f'object = "{ids[2]}"' in dock.editing.text


def test_who_is_renamed_has_the_new_name_in_every_form(dock, qtbot):
    from dataclasses import replace

    bench, person = dock._bench, scenario(dock).people[0].person_id
    assert bench.do("scenario.add_action", person=person, do="receive", index=0)
    assert bench.do("scenario.add_fault", name="occluder")
    dock.edit_action((person, 0))
    first, second = dock.object_ids()[:2]
    names = {first: "Grandma's", second: "Grandma's", person: "Ana Maria"}
    document = bench.document
    bench.change("Rename", replace(document, twin=replace(document.twin, names=names)))
    wanted = [f"Grandma's ({first})", f"Grandma's ({second})"]
    assert boxes(dock.form.widget)[0][0][:2] == wanted
    row = next(row for row in dock.knobs._rows.values() if row.name == "occluder")
    assert boxes(row._form)[0][0][:2] == wanted
    assert dock.form.title.text().startswith("Ana Maria, 1.")
    assert "Ana Maria" in boxes(dock.tabs.widget(0))[0][0]
    words = [item.text() for item in dock.floor.scene().items() if hasattr(item, "text")]
    assert "Ana Maria" in words
    assert person not in words
    bench.history.undo()
    assert dock.form.title.text().startswith(f"{bench.name_of(person)}, 1.")
