"""Stray splats are taken out of a room by lasso and brush, and brought back."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.package import load_package, save_package
from studio.console.display import why_no_window
from tests.crate_room import HIGH, joined, splats_on

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
STRAY = np.array([0.0, 0.0, HIGH[2] + 0.2])
COUNT = 80


@pytest.fixture
def cleaning(scene, objects_page, until):
    """The window on a room with stray splats over its crate, and the page to mark them on."""
    package = load_package(scene)
    stray = STRAY + np.random.default_rng(5).normal(0.0, 0.015, (COUNT, 3))
    room = joined(package.room, splats_on(stray, (0.9, 0.2, 0.2)))
    save_package(replace(package, room=room), scene)
    window, page = objects_page(scene)
    page.load_button.click()
    until(lambda: page.views.count() == 3)
    return window, page


def drawn_around(page, package, radius_px, count):
    """Places of the widget around the stray splats in the view that is shown."""
    from PySide6.QtCore import QPointF

    view = next(v for v in package.views if v.name == page.views.currentText())
    pixels, _ = view.camera.project((view.world_from_camera.inverse() @ STRAY)[None])
    area = page.marker._area()
    scale = area.width() / view.camera.width_px
    angles = np.linspace(0.0, 2 * np.pi, count)
    around = pixels[0] + radius_px * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [(area.topLeft() + QPointF(*at) * scale).toPoint() for at in around]


def draw(marker, places):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    QTest.mousePress(marker, Qt.MouseButton.LeftButton, pos=places[0])
    for place in places[1:]:
        QTest.mouseMove(marker, place)
    QTest.mouseRelease(marker, Qt.MouseButton.LeftButton, pos=places[-1])


@pytest.mark.parametrize("tool", ["Lasso", "Brush"])
def test_what_is_drawn_around_is_taken_out_and_comes_back(cleaning, scene, until, tool):
    window, page = cleaning
    before = load_package(scene)
    page.tool.setCurrentText(tool)
    assert not page.clean_button.isEnabled()
    page.marker.radius_px = 14.0
    radius_px = 16.0 if tool == "Lasso" else 4.0
    draw(page.marker, drawn_around(page, before, radius_px, 14))
    assert page.clean_button.isEnabled()
    page.clean_button.click()
    until(lambda: page.job is None)
    until(lambda: "splats removed" in page.line.text())
    left = load_package(scene).room
    gone = len(before.room) - len(left)
    assert 0.9 * COUNT <= gone <= COUNT + 2, "the crate below and the floor behind stay"
    until(lambda: window.bench.scene is not None and len(window.bench.scene.room) == len(left))
    until(page.undo_button.isEnabled)
    window.menus.menu("Preparation").aboutToShow.emit()
    assert window.menus.qt_action("preparation.undo_cut").isEnabled()
    page.undo_button.click()
    assert np.array_equal(load_package(scene).room.means, before.room.means)
    until(lambda: not window.run.is_busy)


def test_marks_of_a_view_are_kept_shown_and_cleared(cleaning):
    from PySide6.QtCore import QPoint, QPointF, Qt
    from PySide6.QtGui import QWheelEvent
    from PySide6.QtWidgets import QApplication

    window, page = cleaning
    package = window.bench.scene
    first = page.views.currentText()
    page.tool.setCurrentText("Lasso")
    draw(page.marker, drawn_around(page, package, 16.0, 12))
    page.tool.setCurrentText("Brush")
    wheel = QWheelEvent(
        QPointF(5, 5),
        QPointF(5, 5),
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    radius_px = page.marker.radius_px
    QApplication.sendEvent(page.marker, wheel)
    assert page.marker.radius_px > radius_px
    draw(page.marker, drawn_around(page, package, 3.0, 4))
    assert (len(page.marks[first].outlines), len(page.marks[first].strokes)) == (1, 1)
    page.views.setCurrentIndex(1)
    assert not page.marker.outlines
    page.views.setCurrentIndex(0)
    assert len(page.marker.outlines) == len(page.marker.strokes) == 1
    page.clear_button.click()
    assert not page.marks
    assert not page.clean_button.isEnabled()
