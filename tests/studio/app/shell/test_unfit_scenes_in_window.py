"""A scene that cannot be rehearsed in says what to do, and a button does it."""

import dataclasses

import numpy as np
import pytest

from scenes.formats.ply import write_ply
from scenes.package import save_package
from scenes.package.reality import Reality
from studio.app.model.documents.document import Document
from studio.console.display import why_no_window
from tests.scanned_cell import scan

__all__ = ["scan"]

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def opened(tmp_path, qapp, until, monkeypatch):
    """Opens a window on a scene."""
    from studio.app.window import dispose, make_window

    monkeypatch.setattr("platformdirs.user_cache_dir", lambda _: str(tmp_path / "cache"))
    windows = []

    def make(scene):
        window = make_window(
            Document(str(scene)), rehearse_to=tmp_path / "sessions", home=tmp_path / "home"
        )
        windows.append(window)
        window.bench.set(has_started=True)
        window.run.open_scene(str(scene))
        window.show()
        until(lambda: window.is_filled and window.bench.scene is not None)
        qapp.setActiveWindow(window)
        return window

    yield make
    for window in windows:
        window.close()
        dispose(window)


def rehearse(window, until):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    window.problem.hide()
    QTest.keyClick(window, Qt.Key.Key_F5)
    until(window.problem.isVisible)
    return window.problem.text


def test_after_a_cut_a_button_trains_the_photos_once_more_and_rehearses(
    opened, scan, tmp_path, until, monkeypatch
):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    path = tmp_path / "cell.gnx"
    save_package(scan.scene, path)
    window = opened(path)
    # Without the photos there is nothing to train: that is said, with where to begin.
    text = rehearse(window, until)
    assert "cell.gnx.prepare is not beside it" in text
    window.problem.choose("Prepare a room from photos")
    assert window.content("preparation").isVisible()
    (tmp_path / "cell.gnx.prepare" / "training").mkdir(parents=True)
    text = rehearse(window, until)
    assert "its photos are trained once more" in text
    trained = []

    def with_reality(package, work, *, seed, seconds, progress):
        progress(0.5, "reality: step 1")
        trained.append(work)
        write_ply(tmp_path / "second.ply", scan.room)
        return dataclasses.replace(
            package, reality=Reality(tmp_path / "second.ply", "test", 9, 8, np.eye(7) * 1e-6)
        )

    monkeypatch.setattr("scenes.prepare.reality.with_reality", with_reality)
    window.problem.choose("Train the photos again and rehearse")
    until(lambda: window.run.job.session is not None, limit_s=60)  # it plays
    assert trained == [tmp_path / "cell.gnx.prepare"]
    QTest.keyClick(window, Qt.Key.Key_F5, Qt.KeyboardModifier.ShiftModifier)
    until(lambda: not window.run.is_busy, limit_s=60)


def test_a_splat_file_alone_goes_to_where_its_size_is_given(opened, scan, tmp_path, until):
    write_ply(tmp_path / "hall.ply", scan.room)
    window = opened(tmp_path / "hall.ply")
    text = rehearse(window, until)
    assert "photos" not in text
    assert "how large they are" in text
    window.problem.choose("Make a room of this file")
    page = window.content("preparation").room
    assert page.isVisible()
    assert page.source == tmp_path / "hall.ply"
    assert "Scale unknown" in page.notice.text()
