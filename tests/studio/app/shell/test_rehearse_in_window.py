import signal
import threading
import time

import pytest

from studio.app.model.scene_job import SceneJob
from studio.console.display import why_no_window
from studio.session.pipeline import CancelledError
from studio.session.session import SessionPlan

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def application():
    from PySide6.QtWidgets import QApplication

    return QApplication.instance() or QApplication(["test"])


@pytest.fixture
def play(tiny, tmp_path, monkeypatch, application):
    """Opens the window on a rehearsal in the tiny room; `until` waits while Qt works."""
    from studio import rehearsal
    from studio.app.old_window import StudioWindow

    windows = []

    def start(**options):
        monkeypatch.setattr(
            rehearsal, "open_session", lambda plan, **given: tiny.session(plan, **options, **given)
        )
        out = tmp_path / "demo"
        job = SceneJob("tiny", SessionPlan(methods=("own",)), out)
        window = StudioWindow("tiny", job, rehearse_to=out)
        window.show()
        windows.append(window)
        return window

    def until(condition):
        deadline = time.monotonic() + 30
        while not condition():
            assert time.monotonic() < deadline, "the window did not get there in 30 s"
            application.processEvents()

    start.until = until
    yield start
    for window in windows:
        window.close()


def test_shows_camera_and_twin_and_ends_with_the_verdict(play, tmp_path):
    window = play()
    play.until(lambda: window.camera.has_picture and window.twin.has_picture)
    play.until(lambda: "every figure meets its bar" in window.line)
    assert (tmp_path / "demo" / "report.html").exists()
    picture = window.grab().toImage()
    colours = {
        picture.pixel(x, y)
        for x in range(0, window.twin.width(), 5)
        for y in range(60, window.height() - 60, 5)
    }
    assert len(colours) > 50


def test_dragging_turns_the_view(play):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    window = play()
    play.until(lambda: window.twin.orbit is not None)
    before = window.twin.orbit
    QTest.mousePress(window.twin, Qt.MouseButton.LeftButton, pos=QPoint(100, 100))
    QTest.mouseMove(window.twin, QPoint(160, 100))
    QTest.mouseRelease(window.twin, Qt.MouseButton.LeftButton, pos=QPoint(160, 100))
    play.until(lambda: window.twin.orbit.yaw != before.yaw)
    QTest.keyClick(window.twin, Qt.Key.Key_F)
    play.until(lambda: window.twin.orbit == before)


def test_closing_early_cancels_and_leaves_nothing(play, tiny, tmp_path):
    hold = threading.Event()

    def slow():
        inputs = tiny.inputs()
        yield next(inputs)
        hold.wait(timeout=30)
        yield from inputs

    window = play(inputs=slow)
    play.until(lambda: window.camera.has_picture)
    threading.Timer(0.2, hold.set).start()
    window.close()
    assert isinstance(window.job.failure, CancelledError)
    assert not window.job.running
    assert list(tmp_path.iterdir()) == []


def test_an_error_is_shown_in_words(play):
    def broken():
        raise ValueError("the camera fell over")
        yield

    window = play(inputs=broken)
    play.until(lambda: "the camera fell over" in window.line)


@pytest.fixture
def close_when(application):
    """Closes every window as soon as a condition on the open one holds, or after 30 s."""
    from PySide6.QtCore import QTimer

    timer, started = QTimer(), time.monotonic()

    def arm(condition):
        def look():
            windows = [w for w in application.topLevelWidgets() if hasattr(w, "job")]
            late = time.monotonic() - started > 30
            for window in windows:
                if window.isVisible() and (late or condition(window)):
                    window.close()

        timer.timeout.connect(look)
        timer.start(20)

    yield arm
    timer.stop()


def test_a_replay_in_a_window_is_compared_to_its_end(tiny, monkeypatch, close_when):
    from studio.app import window, worker

    monkeypatch.setattr(worker, "open_session", tiny.session)
    close_when(lambda w: w.line == "ready")
    seen = []
    window.replay_in_window(SessionPlan(methods=("own",)), seen.append)
    assert [output.input.frame.seq for output in seen] == list(range(tiny.frames))


def test_closing_a_rehearsal_early_is_a_cancellation(tiny, tmp_path, monkeypatch, close_when):
    from studio import rehearsal
    from studio.app import window

    monkeypatch.setattr(rehearsal, "open_session", tiny.session)
    close_when(lambda w: w.camera.has_picture)
    with pytest.raises(KeyboardInterrupt):
        window.rehearse_in_window(SessionPlan(), tmp_path / "demo")
    assert list(tmp_path.iterdir()) == []


def test_a_scene_opens_and_can_be_looked_at(tiny, tmp_path, close_when):
    from scenes.package import save_package
    from studio.app.old_window import open_window

    save_package(tiny.scene, tmp_path / "room")
    looked = []
    close_when(lambda w: w.twin.has_picture and not looked.append(w.line))
    assert open_window(str(tmp_path / "room"), rehearse_to=tmp_path / "out") == 0
    assert looked


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_in_the_terminal_closes_the_window(tiny, tmp_path, close_when, number):
    from scenes.package import save_package
    from studio.app.old_window import open_window

    save_package(tiny.scene, tmp_path / "room")
    before = signal.getsignal(number)
    close_when(lambda w: w.twin.has_picture and signal.raise_signal(number))
    with pytest.raises(KeyboardInterrupt):
        open_window(str(tmp_path / "room"), rehearse_to=tmp_path / "out")
    assert signal.getsignal(number) is before


def test_a_missing_scene_is_an_error_of_the_caller(tmp_path, close_when):
    from studio.app.old_window import open_window

    close_when(lambda w: w.line.startswith("✗"))
    with pytest.raises(ValueError, match="nowhere"):
        open_window(str(tmp_path / "nowhere"), rehearse_to=tmp_path / "out")


def test_four_clicks_in_the_camera_picture_make_a_live_surface(play, tiny, monkeypatch):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtGui import QAction
    from PySide6.QtTest import QTest

    from studio.app import window as window_module

    clicked = []

    def make(name, clicks_px, frame, world_from_rig, room):
        clicked.append(clicks_px)
        raise ValueError(f"{name}: nothing flat there")

    monkeypatch.setattr(window_module, "clicked_surface", make)
    hold = threading.Event()

    def waiting():
        inputs = tiny.inputs()
        yield next(inputs)
        hold.wait(timeout=30)

    window = play(inputs=waiting)
    play.until(lambda: window.camera.has_picture)
    action = next(a for a in window.findChildren(QAction) if a.text() == "Live surface")
    play.until(action.isEnabled)
    action.trigger()
    assert window.camera.picking
    pane = window.camera
    middle = QPoint(pane.width() // 2, pane.height() // 2)
    for dx, dy in ((-20, -20), (20, -20), (20, 20), (-20, 20)):
        QTest.mouseClick(pane, Qt.MouseButton.LeftButton, pos=middle + QPoint(dx, dy))
    assert not pane.picking
    assert not action.isChecked()
    scale = 64 / min(pane.width(), pane.height())
    assert clicked[0].mean(axis=0) == pytest.approx([32, 32], abs=2 * scale)
    assert clicked[0][1, 0] - clicked[0][0, 0] == pytest.approx(40 * scale, abs=1e-6)
    assert "surface 1: nothing flat there" in window.line
    hold.set()
