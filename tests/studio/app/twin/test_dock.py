import numpy as np
import pytest

from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Avatar, LiveSurface, Proposal, SceneState, SharedPrimitive
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def dock(bench, qtbot):
    from studio.app.twin.dock import TwinDock

    made = TwinDock(bench)
    made.show()
    yield made
    made.close()
    made.deleteLater()


def rows(dock):
    found = {}
    for place in range(dock.tree.topLevelItemCount()):
        heading = dock.tree.topLevelItem(place)
        found[heading.text(0)] = [heading.child(i).text(0) for i in range(heading.childCount())]
    return found


def test_objects_of_the_scan_are_listed_and_selected_both_ways(dock, bench):
    item = bench.scene.objects[0]
    assert len(rows(dock)["Objects"]) == len(bench.scene.objects)
    bench.select(item.object_id)
    assert dock.tree.currentItem().text(0) == item.name
    other = dock.tree.topLevelItem(0).child(1)
    dock.tree.setCurrentItem(other)
    assert bench.selection == bench.scene.objects[1].object_id


def test_what_photos_saw_of_an_object_is_said(dock, bench):
    bench.select(bench.scene.objects[0].object_id)
    assert dock.inspector.seen.text() == "not measured"
    bench.select(None)
    assert dock.inspector.seen.text() == ""


def test_a_number_moves_the_object_and_undo_takes_it_back(dock, bench):
    item = bench.scene.objects[0]
    bench.select(item.object_id)
    before = dock.inspector.place[0].value()
    dock.inspector.place[0].setValue(before + 0.25)
    moved = bench.state.objects[item.object_id].world_from_object.translation
    assert np.isclose(moved[0], before + 0.25, atol=1e-3)
    bench.history.undo()
    dock.refresh()
    assert np.isclose(dock.inspector.place[0].value(), before)


def test_physics_with_all_at_rest_says_that_nothing_moves(dock, bench, qtbot):
    from PySide6.QtCore import Qt

    document = bench.document
    qtbot.mouseClick(dock.run, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: bench.notice is not None, timeout=120_000)
    assert bench.notice.text.startswith("Nothing moves: all objects rest")
    assert not dock.physics.is_busy
    assert bench.document is document


def test_in_twice_as_large_text_names_and_several_objects_are_seen(dock, bench, qapp):
    from studio.app.shell.theme import apply_theme

    bench.select(bench.scene.objects[0].object_id)
    try:
        for scale in (1.0, 2.0):
            apply_theme(qapp, "light", scale)
            dock.resize(250, 520)
            dock.refresh()
            qapp.processEvents()
            tree, name = dock.tree, bench.scene.objects[0].name
            row = tree.currentItem()
            shown = tree.visualItemRect(row)
            taken = tree.indentation() * 2 + tree.iconSize().width() + 12
            assert tree.fontMetrics().horizontalAdvance(name) < tree.columnWidth(0) - taken
            assert tree.viewport().height() >= 3.5 * shown.height()
            assert tree.iconSize().width() == round(16 * scale)
            assert tree.isColumnHidden(1) == (scale == 2.0)
    finally:
        apply_theme(qapp, "dark", 1.0)


def test_what_is_added_is_listed_selected_and_removed(dock, bench):
    assert bench.do("twin.add_primitive", shape="box")
    assert bench.do("twin.add_avatar", role="remote")
    dock.refresh()
    found = rows(dock)
    assert len(found["Primitives"]) == len(found["People"]) == 1
    assert bench.do("twin.remove", item=next(iter(bench.document.twin.primitives)))
    dock.refresh()
    assert "Primitives" not in rows(dock) or rows(dock)["Primitives"] == []


def test_people_and_their_things_are_listed_by_name_and_cannot_be_edited(dock, bench):
    item = bench.scene.objects[0]
    head = look_at(np.array([0.5, 0.2, 1.5]), np.array([2.0, 0.2, 1.0]))
    there = Pose.from_yaw(0.4, (0.5, 0.5, 0.0))
    corners = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]], dtype=float)
    box = SharedPrimitive("p1/b", "p1", "box", (0.3, 0.3, 0.4), (1, 0, 0), there)
    state = SceneState(
        avatars={"p1": Avatar("p1", "remote", head, name="Ann 1")},
        primitives={"p1/b": box},
        proposals={"p1/c": Proposal("p1/c", "p1", "Ann 1", item.object_id, there)},
        surfaces={"p1/s": LiveSurface("p1/s", corners, (16, 16), "cam", corners + 1)},
    )
    bench.show_state(state)
    dock.refresh()
    found = rows(dock)
    assert found["People"] == ["Ann 1"]
    assert found["Primitives"] == ["box"]
    assert found["Proposals"] == [item.name]
    assert found["Live surfaces"] == ["p1/s"]
    bench.select("p1/b")
    assert dock.inspector.state.text() == "of Ann 1"
    assert not dock.inspector.remove.isEnabled()
    assert not dock.inspector.place[0].isEnabled()
    assert dock.inspector.name.isReadOnly()
    bench.select("p1")
    assert dock.inspector.name.text() == "Ann 1"
    bench.select(item.object_id)
    assert not dock.inspector.name.isReadOnly()
    bench.show_state(None)
