"""The preparation panel in a real window: dropping, the unknown scale, marking, cancelling."""

from types import SimpleNamespace

import numpy as np
import pytest

from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def bench():
    return Workbench(Document("lab"), Settings(), SimpleNamespace(push=print, clear=print))


@pytest.fixture
def dock(bench, qtbot):
    from studio.app.preparation.dock import PreparationDock

    made = PreparationDock(bench)
    qtbot.addWidget(made)
    made.resize(380, 640)
    made.show()
    return made


def test_a_splat_file_without_scale_gets_a_notice_and_is_not_prepared(dock, bench, tmp_path):
    path = tmp_path / "scan.ply"
    path.touch()
    assert bench.do("preparation.add", path=str(path))
    assert "Scale unknown" in dock.room.notice.text()
    assert not dock.room.notice.isHidden()
    assert not bench.do("preparation.start")
    assert dock.room.job is None
    dock.room.ceiling.setValue(2.5)
    assert dock.room.notice.isHidden()


def test_photos_are_shown_upright_for_their_ends_whatever_their_format(dock, bench, tmp_path):
    from PIL import Image
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    stored = Image.new("RGB", (3200, 1600))
    stored.paste((255, 0, 0), (0, 0, 1600, 1600))
    exif = Image.Exif()
    exif[0x112] = 6  # to be turned by 90° to the right
    stored.save(tmp_path / "a.jpg", exif=exif)
    Image.new("RGB", (40, 30)).save(tmp_path / "b.tif")
    assert bench.do("preparation.add", path=str(tmp_path / "b.tif"))  # all of its folder
    assert dock.room.source == tmp_path
    ends = dock.room.ends
    assert [ends.photos.itemText(k) for k in range(ends.photos.count())] == ["a.jpg", "b.tif"]
    image = ends.marker._image
    assert (image.width(), image.height()) == (800, 1600)
    assert image.pixelColor(400, 200).red() > 200
    area = ends.marker._area()
    QTest.mouseClick(
        ends.marker, Qt.MouseButton.LeftButton, pos=area.topLeft().toPoint() + QPoint(1, 1)
    )
    ((photo, x, y),) = ends.picks()["a"]
    assert photo == "a.jpg"
    assert (x, y) == pytest.approx((0, 0), abs=2 * 3200 / area.height())


def test_a_preparation_that_fails_says_so_in_the_panel_and_in_the_log(dock, bench, qtbot, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    assert bench.do("preparation.add", path=str(photos))
    assert bench.do("preparation.start")
    qtbot.waitUntil(lambda: bool(dock.room.verdict.text()), timeout=60_000)
    assert dock.room.verdict.text().startswith("✖ ")
    assert bench.log.lines("error")


def test_left_is_what_is_left_and_the_preview_fits_a_narrow_dock(dock, bench, qtbot, tmp_path):
    from PySide6.QtGui import QImage

    from studio.app.preparation.stage_lines import stages_of

    page = dock.room
    picture = tmp_path / "1.jpg"
    assert QImage(640, 480, QImage.Format.Format_RGB32).save(str(picture))
    lines = ["poses …", "poses: 40 s", "outdoor points …", "outdoor points  25%, 12 s left"]
    page.job = SimpleNamespace(
        is_running=True, stages=stages_of(lines), preview=picture, problem="", cancel=print
    )
    page._is_open = True
    dock.resize(240, 640)
    page.refresh()
    shown = [page.stages.topLevelItem(i) for i in range(2)]
    cells = [[item.text(column).strip() for column in range(4)] for item in shown]
    assert cells[0] == ["poses", "● done", "took 40 s", ""]
    assert cells[1][0] == "outside the windows"
    assert cells[1][3] == "12 s"
    qtbot.waitUntil(
        lambda: 0 < page.preview.pixmap().width() <= page.viewport().width(), timeout=60_000
    )
    assert page.preview.width() >= page.preview.pixmap().width()


def test_what_runs_ends_with_the_window(dock, bench, qtbot, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    assert bench.do("preparation.add", path=str(photos))
    assert bench.do("preparation.start")
    job = dock.room.job
    assert job.is_running
    dock.close()
    qtbot.waitUntil(lambda: not job.is_running, timeout=120_000)
    assert job.problem.startswith("cancelled")


def test_a_box_and_clicks_are_marks_in_the_picture_s_own_pixels(dock, qtbot):
    from PySide6.QtCore import QPoint, Qt

    dock.tabs.setCurrentIndex(1)
    page = dock.cut
    page._show_pictures({"a.png": np.zeros((90, 120, 3), np.uint8)})
    marker = page.marker
    qtbot.waitUntil(lambda: marker.width() > 200, timeout=60_000)
    area = marker._area()
    middle = area.center().toPoint()
    qtbot.mousePress(marker, Qt.MouseButton.LeftButton, pos=area.topLeft().toPoint())
    qtbot.mouseMove(marker, middle)
    qtbot.mouseRelease(marker, Qt.MouseButton.LeftButton, pos=middle)
    np.testing.assert_allclose(page.marks["a.png"].box, (0, 0, 60, 45), atol=0.7)
    page.tool.setCurrentText("Clicks")
    qtbot.mouseClick(marker, Qt.MouseButton.LeftButton, pos=middle + QPoint(3, 0))
    (point,) = page.marks["a.png"].clicks
    assert point[0] > 60
    assert page.cut_button.isEnabled()


def test_built_in_rooms_are_not_cut(dock, bench):
    assert not bench.do("preparation.cut")
    assert "built-in" in bench.log.lines("error")[-1].text
    assert not bench.do("preparation.undo_cut")


def test_two_ends_clicked_in_photos_are_picks_in_the_photo_s_own_pixels(dock, qtbot, tmp_path):
    from PySide6.QtCore import Qt
    from PySide6.QtGui import QImage

    photos = tmp_path / "photos"
    photos.mkdir()
    for name in ("1.png", "2.png"):
        assert QImage(3200, 1600, QImage.Format.Format_RGB32).save(str(photos / name))
    dock.room.add(photos)
    ends = dock.room.ends
    assert ends.isVisible()
    qtbot.waitUntil(lambda: ends.marker.width() > 200, timeout=60_000)
    for end in ("End a", "End b"):
        ends.end.setCurrentText(end)
        for name in ("1.png", "2.png"):
            ends.photos.setCurrentText(name)
            middle = ends.marker._area().center().toPoint()
            qtbot.mouseClick(ends.marker, Qt.MouseButton.LeftButton, pos=middle)
    picks = ends.picks()
    assert [photo for photo, _, _ in picks["a"]] == ["1.png", "2.png"]
    np.testing.assert_allclose(picks["b"][1][1:], (1600, 800), atol=12)
    ends.metres.setValue(2.0)
    assert ends.length_m == 2.0


def test_an_object_is_cut_compared_and_put_back_in_the_panel(bench, dock, qtbot, scene, marks):
    from dataclasses import replace

    from scenes.package import load_package

    bench.change("open", replace(bench.document, scene=str(scene)))
    page = dock.cut
    page.load()
    qtbot.waitUntil(lambda: page.views.count() == 3, timeout=120_000)
    page.marks = {mark.view: mark for mark in marks}
    page.name.setText("Crate")
    assert bench.do("preparation.cut")
    qtbot.waitUntil(lambda: bool(page.kept), timeout=90_000)
    assert "floaters removed" in page.line.text()
    assert [item.object_id for item in load_package(scene).objects] == ["crate"]
    qtbot.waitUntil(lambda: not page.compare._after.isNull(), timeout=120_000)
    before, after = page.compare._before, page.compare._after
    assert before.size() == after.size()
    assert before != after
    assert bench.do("preparation.undo_cut")
    assert load_package(scene).objects == ()
    assert not page.undo_button.isEnabled()
