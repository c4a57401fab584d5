"""From what is dropped on the window to the room that is shown; bad videos say what to do."""

import shutil
import time

import numpy as np
import pytest

from scenes.package import load_package
from scenes.samples import sample_room
from sim.phone.phone import PhoneOptions, film
from studio.app.model.documents.document import Document
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
SMALL = {"frames": 40, "width_px": 640, "height_px": 480, "samples": 1, "duration_s": 40.0}


@pytest.fixture
def opened(tmp_path, qapp):
    from studio.app.window import dispose, make_window

    window = make_window(Document("lab"), rehearse_to=tmp_path / "out", home=tmp_path / "home")
    window.bench.set(has_started=True)
    window.show()

    def until(condition, limit_s=120):
        deadline = time.monotonic() + limit_s
        while not condition():
            assert time.monotonic() < deadline, window.bench.log.lines()
            qapp.processEvents()
            time.sleep(0.01)

    until(lambda: window.is_filled)
    yield window, until
    window.close()
    dispose(window)


def filmed(folder, output):
    options = PhoneOptions(output=output, **SMALL)
    film(sample_room("desk"), folder, rng=np.random.default_rng(1), options=options)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("output", "name"), [("photos", "images"), ("video", "video.mp4")])
def test_what_is_dropped_becomes_the_room_that_is_shown(opened, tmp_path, output, name):
    window, until = opened
    bench = window.bench
    filmed(tmp_path / "film", output)
    assert bench.do("file.drop", paths=[str(tmp_path / "film" / name)])
    page = window.content("preparation").room
    page.quality.setCurrentIndex(page.quality.findData("preview"))
    page.code_side.setValue(0.2)
    assert bench.do("preparation.start")
    until(lambda: not page.job.is_running and bool(page.verdict.text()), limit_s=1500)
    assert page.verdict.text().startswith("● The room is ready")
    assert {line.state for line in page.job.stages} == {"done"}
    assert page.codes.topLevelItemCount() == 2
    assert not page.preview.pixmap().isNull()

    out = page.job.out
    until(lambda: bench.scene is not None and window.view.active.painted is not None)
    assert bench.document.scene == str(out)
    room = load_package(out)
    assert len(bench.scene.room) == len(room.room)
    # The true desk room is 5.0 m by 4.6 m by 2.7 m; splats of walls lie on it.
    low, high = np.percentile(room.room.means, [1, 99], axis=0)
    truth = np.sort(np.ptp(sample_room("desk").footprint_m, axis=0))
    assert np.sort((high - low)[:2]) == pytest.approx(truth, rel=0.15)


def test_views_to_cut_in_fill_the_middle_of_the_window(opened):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    window, until = opened
    window.bench.do("dock.preparation")
    dock = window.content("preparation")
    dock.tabs.setCurrentIndex(1)
    page, room = dock.cut, window.view.active
    width = room.width()
    page._show_pictures({"a.png": np.zeros((90, 120, 3), np.uint8)})
    until(lambda: page.marker.width() >= width)
    assert not room.isVisible()
    middle = page.marker._area().center().toPoint()
    QTest.mousePress(page.marker, Qt.MouseButton.LeftButton, pos=middle - QPoint(80, 60))
    QTest.mouseMove(page.marker, middle)
    QTest.mouseRelease(page.marker, Qt.MouseButton.LeftButton, pos=middle)
    assert page.marks["a.png"].box is not None
    QTest.mouseClick(page.large, Qt.MouseButton.LeftButton)
    until(room.isVisible)
    assert page.marker.parentWidget() is page
    QTest.mouseClick(page.large, Qt.MouseButton.LeftButton)
    until(lambda: not room.isVisible())
    dock.tabs.setCurrentIndex(0)  # whoever leaves the page sees the room again
    until(room.isVisible)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("noise.mp4", b"\x07" * 4000, "it is damaged or not whole: copy it from the camera again"),
        ("empty.mp4", b"", "it is damaged or not whole: copy it from the camera again"),
    ],
)
def test_a_damaged_video_says_so_in_the_panel(opened, tmp_path, name, data, words):
    window, until = opened
    (tmp_path / name).write_bytes(data)
    assert window.bench.do("file.drop", paths=[str(tmp_path / name)])
    assert window.bench.do("preparation.start")
    page = window.content("preparation").room
    until(lambda: bool(page.verdict.text()))
    assert words in page.verdict.text()
    assert page.verdict.text().startswith(f"✖ {tmp_path / name}: ")
    assert words in window.bench.log.lines("error")[-1].text
    assert page.start_button.isEnabled()
    assert not shutil.os.path.exists(page.job.out)
