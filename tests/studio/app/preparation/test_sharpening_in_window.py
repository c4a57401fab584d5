"""A place that is marked in a view is sharpened in the window, and undo gives its bytes back."""

import pytest

from studio.console.display import why_no_window
from tests.prepared_floor import make_prepared_floor
from tests.studio.app.preparation.test_jobs import digest

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def sharpening(tmp_path, objects_page):
    """The window on a coarse floor of which the photos are there, and the page to mark them on."""
    scene = make_prepared_floor(tmp_path)
    return scene, objects_page(scene)[1]


def test_what_is_marked_gets_sharper_and_undo_brings_the_bytes_back(sharpening, until):
    from PySide6.QtCore import QPointF, Qt
    from PySide6.QtTest import QTest

    scene, page = sharpening
    before = digest(scene)
    page.load_button.click()
    until(lambda: page.views.count() == 6)
    page.tool.setCurrentText("Box")
    area, aside = page.marker._area(), 0.35
    low, high = (
        QPointF(area.left() + share * area.width(), area.top() + share * area.height()).toPoint()
        for share in (0.5 - aside, 0.5 + aside)
    )
    QTest.mousePress(page.marker, Qt.MouseButton.LeftButton, pos=low)
    QTest.mouseMove(page.marker, high)
    QTest.mouseRelease(page.marker, Qt.MouseButton.LeftButton, pos=high)
    assert page.marks
    page.sharpen_button.click()
    assert not page.sharpen_button.isEnabled()
    until(lambda: page.job is None, 120)
    assert "region: " in page.line.text()
    assert "photos" in page.line.text()
    assert digest(scene) != before
    until(page.undo_button.isEnabled)
    page.undo_button.click()
    assert digest(scene) == before


def test_nothing_to_sharpen_is_said_and_the_scene_is_left(sharpening, until):
    scene, page = sharpening
    before = digest(scene)
    page.sharpen_button.click()
    until(lambda: page.job is None, 60)
    assert "no object was cut out" in page.line.text()
    assert digest(scene) == before
    assert not page.undo_button.isEnabled()
