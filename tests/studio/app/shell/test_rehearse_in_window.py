import signal
import threading
import time

import pytest

from studio import rehearsal
from studio.app.model.jobs.scene_job import SceneJob
from studio.console.display import why_no_window
from studio.session.pipeline import CancelledError
from studio.session.plan import SessionPlan

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture(autouse=True)
def own_home(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path_factory.mktemp("home")))


@pytest.fixture
def application():
    from PySide6.QtWidgets import QApplication

    return QApplication.instance() or QApplication(["test"])


@pytest.fixture
def play(tiny, tmp_path, monkeypatch, application):
    """Opens the window on a rehearsal in the tiny room; `until` waits while Qt works."""
    from studio.app.model.documents.document import Document
    from studio.app.window import dispose, make_window
    from studio.session import opening

    windows = []

    def start(**options):
        def open_tiny(plan, **given):
            return tiny.session(plan, **options, **given)

        monkeypatch.setattr(rehearsal, "open_session", open_tiny)
        monkeypatch.setattr(opening, "open_session", open_tiny)
        out = tmp_path / "demo"
        job = SceneJob("tiny", SessionPlan(methods=("own",)), out)
        window = make_window(Document("tiny"), rehearse_to=out)
        window.run.play(job)
        window.show()
        windows.append(window)
        return window

    def until(condition):
        deadline = time.monotonic() + 120
        while not condition():
            assert time.monotonic() < deadline, "the window did not get there in a minute"
            application.processEvents()
            time.sleep(0.001)

    start.until = until
    yield start
    for window in windows:
        window.close()
        dispose(window)


def has_picture(window):
    return window.view is not None and window.view.active.painted is not None


def test_shows_the_twin_and_ends_with_the_verdict(play, tmp_path):
    window = play()
    play.until(lambda: window.bench.camera_picture is not None and has_picture(window))
    play.until(lambda: "recorded; the report is in" in window.line)
    assert (tmp_path / "demo" / "report.html").exists()
    picture = window.view.grab().toImage()
    colours = {
        picture.pixel(x, y)
        for x in range(0, picture.width(), 5)
        for y in range(0, picture.height(), 5)
    }
    assert len(colours) > 50
    play.until(lambda: window.bench.recording is not None)


def test_dragging_turns_the_view(play):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    window = play()
    play.until(lambda: has_picture(window))
    view = window.view.active
    before = view.viewer
    QTest.mousePress(view, Qt.MouseButton.LeftButton, pos=QPoint(100, 100))
    QTest.mouseMove(view, QPoint(160, 100))
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, pos=QPoint(160, 100))
    play.until(lambda: view.viewer.orbit.yaw != before.orbit.yaw)
    window.bench.do("view.home")
    assert view.viewer == before
    QTest.keyClick(view, Qt.Key.Key_W)
    assert view.viewer != before


def test_closing_early_cancels_and_leaves_nothing(play, tiny, tmp_path):
    hold = threading.Event()

    def slow():
        inputs = tiny.inputs()
        yield next(inputs)
        hold.wait(timeout=30)
        yield from inputs

    window = play(inputs=slow)
    play.until(lambda: window.bench.camera_picture is not None)
    threading.Timer(0.2, hold.set).start()
    window.close()
    assert isinstance(window.run.job.failure, CancelledError)
    assert not window.run.is_busy
    assert list(tmp_path.iterdir()) == []


def test_an_error_is_shown_in_words(play):
    def broken():
        raise ValueError("the camera fell over")
        yield

    window = play(inputs=broken)
    play.until(lambda: any("the camera fell over" in x.text for x in window.bench.log.lines()))
    assert not window.run.is_busy


@pytest.fixture
def close_when(application):
    """Closes every window as soon as a condition on the open one holds, or after a minute."""
    from PySide6.QtCore import QTimer

    timer, started = QTimer(), time.monotonic()

    def arm(condition):
        def look():
            windows = [w for w in application.topLevelWidgets() if hasattr(w, "bench")]
            late = time.monotonic() - started > 60
            for window in windows:
                if window.isVisible() and hasattr(window, "run") and (late or condition(window)):
                    window.close()

        timer.timeout.connect(look)
        timer.start(20)

    yield arm
    timer.stop()


def test_a_replay_in_a_window_is_compared_to_its_end(tiny, monkeypatch, close_when):
    from studio.app import window
    from studio.session import opening

    monkeypatch.setattr(opening, "open_session", tiny.session)
    close_when(lambda w: w.run.line == "the replay has ended")
    seen = []
    window.replay_in_window(SessionPlan(methods=("own",)), seen.append)
    assert [output.input.frame.seq for output in seen] == list(range(tiny.frames))


def test_closing_a_rehearsal_early_is_a_cancellation(tiny, tmp_path, monkeypatch, close_when):
    from studio.app import window

    monkeypatch.setattr(rehearsal, "open_session", tiny.session)
    close_when(lambda w: w.run.is_playing)
    with pytest.raises(KeyboardInterrupt):
        window.rehearse_in_window(SessionPlan(), tmp_path / "demo")
    assert list(tmp_path.iterdir()) == []


def test_a_scene_opens_and_can_be_looked_at(tiny, tmp_path, close_when):
    from scenes.package import save_package
    from studio.app.window import open_window

    save_package(tiny.scene, tmp_path / "room")
    looked = []
    close_when(lambda w: has_picture(w) and not looked.append(w.line))
    assert open_window(str(tmp_path / "room"), rehearse_to=tmp_path / "out") == 0
    assert looked


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_in_the_terminal_closes_the_window(tiny, tmp_path, close_when, number):
    from scenes.package import save_package
    from studio.app.window import open_window

    save_package(tiny.scene, tmp_path / "room")
    before = signal.getsignal(number)
    close_when(lambda w: has_picture(w) and signal.raise_signal(number))
    with pytest.raises(KeyboardInterrupt):
        open_window(str(tmp_path / "room"), rehearse_to=tmp_path / "out")
    assert signal.getsignal(number) is before


def test_a_missing_scene_is_an_error_of_the_caller(tmp_path, close_when):
    from studio.app.window import open_window

    close_when(lambda w: w.line.startswith("✖"))
    with pytest.raises(ValueError, match="nowhere"):
        open_window(str(tmp_path / "nowhere"), rehearse_to=tmp_path / "out")
