"""Gizmo, numbers and scripts are one path: what is dragged is what a script does again."""

import json
from itertools import pairwise

import numpy as np
import pytest
import trimesh

from studio.app.model.documents.document_file import document_to_text
from studio.app.model.script import read_script
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def add_one_of_each(bench, tmp_path, until):
    """A body, a person, a camera, a live surface, a note and a tilted mesh; their ids."""
    path = tmp_path / "shelf.stl"
    trimesh.creation.box((300.0, 200.0, 400.0)).export(path)
    bench.perform("twin.add_primitive", shape="box", place=[0.3, 0.1, 0.0])
    bench.perform("twin.add_avatar", place=[-0.4, 0.3, 0.0], role="remote")
    bench.perform("twin.add_camera", place=[0.5, -0.5, 1.0], looks_at=[0.0, 0.5, 0.2])
    bench.perform(
        "twin.add_surface",
        corners=[[-0.3, 0.5, 0.6], [0.3, 0.5, 0.6], [0.3, 0.5, 0.2], [-0.3, 0.5, 0.2]],
    )
    bench.perform("twin.annotate", points=[[0.0, 0.0, 0.1], [0.3, 0.0, 0.1]])
    bench.perform("twin.add_mesh", path=str(path), place=[-0.2, -0.2, 0.0])
    until(lambda: not bench.busy)
    bench.perform("twin.tilt", item="mesh-1", x_deg=25.0, y_deg=-15.0)
    return ["box-1", "remote-1", "camera-1", "surface-1", "note-1", "mesh-1"]


def handles_in_turn(view):
    """Every handle of the gizmo that can be pressed now, by each tool."""
    return [] if view._handles().gizmo is None else list(view._handles().gizmo.lines())


def drag(view, handle):
    """Drag a handle by the mouse, where it is not under another one."""
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    gizmo = view._handles().gizmo
    line = gizmo.lines()[handle]
    places = [a + share * (b - a) for a, b in pairwise(line) for share in (0.5, 0.8, 1.0)]
    free = [at for at in places[::-1] if gizmo.hit(*at) == handle]
    if not free:
        return False
    start = QPoint(*(round(float(v)) for v in free[0]))
    left = Qt.MouseButton.LeftButton
    QTest.mousePress(view, left, pos=start)
    for step in (6, 15):
        QTest.mouseMove(view, start + QPoint(step, -step // 2))
    QTest.mouseRelease(view, left, pos=start + QPoint(15, -7))
    return True


def numbers_rounded(document):
    """The document's file with places to a micrometre: moved points are summed up once more."""
    text = document_to_text(document)
    return json.loads(text, parse_float=lambda number: round(float(number), 6) + 0.0)


def test_what_was_dragged_is_done_again_by_its_script(desk, tmp_path):
    from studio.app.viewport.orbit import Orbit

    bench, view = desk.window.bench, desk.window.view.active
    items = [*add_one_of_each(bench, tmp_path, desk.until), bench.scene.objects[0].object_id]
    view.viewer = view.viewer.__class__(Orbit((0.0, 0.0, 0.3), -1.2, 0.6, 3.0), view.viewer.walker)
    desk.until(lambda: view.painted is not None)
    dragged = set()
    for item in items:
        bench.select(item)
        for tool in ("select", "move", "turn", "scale"):
            bench.perform(f"view.tool_{tool}")
            for handle in handles_in_turn(view):
                before = bench.document
                if drag(view, handle):
                    assert bench.document is not before, f"{item}: {handle} does nothing"
                    dragged.add((item, handle))
    kinds = {item: {handle for of, handle in dragged if of == item} for item in items}
    turning, tilting = {"yaw"}, {"yaw", "tilt_x", "tilt_y"}
    moving, sizing = {"x", "y", "z", "floor"}, {"size", "size_x", "size_y", "size_z"}
    assert kinds["surface-1"] == kinds["note-1"] == moving
    assert kinds["remote-1"] == moving | turning
    assert kinds["camera-1"] == kinds[items[-1]] == moving | tilting
    assert kinds["box-1"] == kinds["mesh-1"] == moving | tilting | sizing

    script = "\n".join(bench.trace())
    wanted = numbers_rounded(bench.document)
    tilt = [line for line in bench.trace() if line.startswith("twin.place item=camera-1")][-1]
    assert "tilt_y_deg" in tilt
    while bench.document.twin.names or bench.document is not bench._saved:
        before = bench.document
        bench.perform("edit.undo")
        assert bench.document is not before
    for step in read_script(script, source="by hand"):
        if step.action_id != "edit.undo":
            bench.perform(step.action_id, **step.values)
            desk.until(lambda: not bench.busy)
    assert numbers_rounded(bench.document) == wanted


def test_tools_stand_in_the_view_and_a_click_selects_with_handles(desk):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    window, bench = desk.window, desk.window.bench
    view, tools = window.view.active, window.view.tools
    item = bench.scene.objects[0]
    desk.until(lambda: view.painted is not None and view.painted.is_full)
    middle = item.world_from_object @ np.array([0.0, 0.0, 0.5 * item.box_m[2]])
    camera_from_world = view.viewer.world_from_camera().inverse()
    at = QPoint(
        *map(round, view._screen_camera().project((camera_from_world @ middle)[None])[0][0])
    )
    QTest.mouseMove(view, at)
    desk.until(lambda: view.hover.item_id == item.object_id)
    assert view._handles().gizmo is None
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=at)
    assert bench.selection == item.object_id
    gizmo = view._handles().gizmo
    assert {"x", "y", "z", "floor", "yaw"} == set(gizmo.lines())
    end = gizmo.lines()["z"][-1]
    QTest.mouseMove(view, QPoint(*map(round, end)))
    assert view.hover.handle == "z"
    for tool, handles in (
        ("turn", {"yaw", "tilt_x", "tilt_y"}),
        ("move", {"x", "y", "z", "floor"}),
    ):
        desk.click(tools.widgetForAction(tools.button(f"view.tool_{tool}")))
        assert view.hand.tool == tool
        assert set(view._handles().gizmo.lines()) == handles
    desk.press("Escape")
    view.setFocus()
    QTest.keyClick(view, Qt.Key.Key_Escape)
    assert tools.button("view.tool_select").isChecked()
    bench.perform("view.four")
    desk.press("4")
    assert {each.hand.tool for each in window.view.views} == {"scale"}, "one tool for all views"
    assert tools.button("view.tool_scale").isChecked()


def test_a_mesh_has_tilt_scale_unit_and_upper_axis_by_numbers(desk, tmp_path):
    bench = desk.window.bench
    add_one_of_each(bench, tmp_path, desk.until)
    bench.select("mesh-1")
    inspector = desk.window.content("twin").inspector

    def mesh():
        return bench.document.twin.meshes["mesh-1"]

    assert (inspector.unit.currentText(), inspector.up.currentText()) == ("mm", "z")
    desk.until(lambda: [spin.value() for spin in inspector.tilt] == [25.0, -15.0])
    type_number(inspector.tilt[0], "40")
    type_number(inspector.scale, "2")
    assert mesh().size_m == pytest.approx((0.6, 0.4, 0.8))
    desk.until(lambda: inspector.extent[0].value() == pytest.approx(0.6))
    type_number(inspector.extent[2], "1.6")
    assert mesh().scale == pytest.approx((2.0, 2.0, 4.0))
    choose(inspector.up, "y")
    assert mesh().size_m == pytest.approx((0.6, 1.6, 0.4))
    desk.until(lambda: inspector.extent[1].value() == pytest.approx(1.6))
    choose(inspector.unit, "m")
    assert inspector.unit.currentText() == "mm", "it would be as large as a street"
    assert "limits 0.01 to 20 m; it stays as it is" in bench.log.lines("error")[-1].text
    choose(inspector.unit, "cm")
    assert mesh().size_m == pytest.approx((6.0, 16.0, 4.0))
    assert "tilt_x_deg" not in bench.trace()[-1]
    for _ in range(5):
        bench.perform("edit.undo")
    assert (mesh().size_m, mesh().unit) == (pytest.approx((0.3, 0.2, 0.4)), "mm")
    desk.until(lambda: inspector.tilt[0].value() == 25.0)


def type_number(spin, text):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    spin.setFocus()
    spin.selectAll()
    QTest.keyClicks(spin, text)
    QTest.keyClick(spin, Qt.Key.Key_Return)


def choose(combo, text):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    combo.setFocus()
    way = 1 if combo.findText(text) > combo.currentIndex() else -1
    key = Qt.Key.Key_Down if way > 0 else Qt.Key.Key_Up
    combo.showPopup()
    for _ in range(abs(combo.findText(text) - combo.currentIndex())):
        QTest.keyClick(combo.view(), key)
    QTest.keyClick(combo.view(), Qt.Key.Key_Return)
