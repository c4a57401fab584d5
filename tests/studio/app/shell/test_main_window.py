import gc
import os
import threading

import pytest

from scenes.pose import Pose
from studio.app.model.actions import Action
from studio.app.model.documents.document import Document, with_item
from studio.app.model.documents.document_file import save_document
from studio.app.model.script import read_script
from studio.app.model.workbench import Topic
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def open_studio(tmp_path, qapp, until):
    from studio.app.window import dispose, make_window

    windows = []

    def start(document=None, scene=None):
        window = make_window(
            document or Document("lab"), rehearse_to=tmp_path / "out", home=tmp_path / "home"
        )
        windows.append(window)
        window.show()
        until(lambda: window.is_filled)
        return window

    yield start
    for window in windows:
        window.close()
        dispose(window)


def moved(bench, x):
    from dataclasses import replace

    twin = bench.document.twin
    poses = with_item(twin.poses, "chair-1", Pose.from_yaw(0.0, (x, 0.0, 0.0)))
    return replace(bench.document, twin=replace(twin, poses=poses))


def x_of(bench):
    found = bench.state.objects.get("chair-1")
    return None if found is None else found.world_from_object.translation[0]


def test_every_dock_is_there_with_its_content(open_studio):
    window = open_studio()
    from studio.app.shell.docking.docks import DOCKS

    for dock in DOCKS:
        assert window.bench.do(f"dock.{dock.id}")
        assert window.docks[dock.id].isVisible()
        assert window.content(dock.id).isVisible()


def test_a_drag_is_one_step_of_undo(open_studio):
    bench = open_studio().bench
    for x in (0.1, 0.2, 0.3):
        bench.change("Move chair-1", moved(bench, x), merge="drag 1")
    bench.change("Move chair-1", moved(bench, 0.9), merge="drag 2")
    bench.do("edit.undo")
    assert x_of(bench) == 0.3
    bench.do("edit.undo")
    assert x_of(bench) is None
    bench.do("edit.redo")
    assert x_of(bench) == 0.3


def test_a_key_of_the_preset_does_its_action(open_studio, qtbot, until):
    from PySide6.QtCore import Qt
    from PySide6.QtWidgets import QApplication

    window = open_studio()
    done = []
    window.bench.actions.add(
        Action("test.key", "Key", "Test", lambda: done.append(1), keys="Ctrl+Shift+Y")
    )
    window.menus.build()
    QApplication.setActiveWindow(window)  # Xvfb has no window manager that would
    qtbot.keyClick(
        window,
        Qt.Key.Key_Y,
        Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier,
    )
    until(lambda: done == [1])
    window.bench.set(keys={"test.key": "Ctrl+Shift+U"})
    qtbot.keyClick(
        window,
        Qt.Key.Key_U,
        Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier,
    )
    until(lambda: done == [1, 1])


def test_the_palette_does_what_is_typed(open_studio, qtbot, until):
    from PySide6.QtCore import Qt

    window = open_studio()
    window.bench.do("palette.open")
    qtbot.keyClicks(window.palette_bar.field, "dark or light")
    qtbot.keyClick(window.palette_bar.field, Qt.Key.Key_Return)
    until(lambda: window.bench.settings.theme == "light")
    assert not window.palette_bar.isVisible()


def test_the_palette_asks_for_arguments(open_studio, qtbot):
    from PySide6.QtCore import Qt

    window = open_studio()
    window.bench.do("palette.open")
    qtbot.keyClicks(window.palette_bar.field, "window.size")
    qtbot.keyClick(window.palette_bar.field, Qt.Key.Key_Return)
    assert window.palette_bar.field.text() == "window.size width= height="


def test_settings_and_layout_are_there_again(open_studio):
    window = open_studio()
    window.bench.set(theme="light", text_scale=1.3)
    window.docks["timeline"].toggleView(False)
    window.close()
    again = open_studio()
    assert (again.bench.settings.theme, again.bench.settings.text_scale) == ("light", 1.3)
    assert not again.docks["timeline"].isVisible()
    again.bench.do("layout.reset")
    assert again.docks["timeline"].isVisible()


def test_the_first_page_is_shown_once(open_studio):
    window = open_studio()
    assert window.first_page.isVisible()
    window.first_page.leave()
    window.close()
    assert open_studio().first_page is None


def test_unsaved_work_is_offered_after_a_crash(open_studio, tmp_path, until):
    import subprocess
    import sys

    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    left = Document("desk", seed=5)
    save_document(left, tmp_path / "home" / f"autosave-{gone.pid}.nexus")
    window = open_studio()
    assert "desk" in window.notice.text
    window.notice.choose("Restore")
    until(lambda: window.bench.document.seed == 5)
    assert not window.bench.is_saved
    # What was left behind goes on as this window's own work.
    (kept,) = (tmp_path / "home").glob("autosave-*.nexus")
    assert kept.name.startswith(f"autosave-{os.getpid()}-")


def test_a_project_is_saved_and_opened(open_studio, tmp_path, until):
    window = open_studio()
    window.bench.change("Move chair-1", moved(window.bench, 0.4))
    assert "•" in window.windowTitle()
    assert window.bench.do("file.save", path=str(tmp_path / "mine"))
    assert window.windowTitle().startswith("mine -")
    window.bench.do("file.new")
    assert x_of(window.bench) is None
    assert window.bench.do("file.open", path=str(tmp_path / "mine.nexus"))
    until(lambda: window.bench.project is not None)
    assert x_of(window.bench) == 0.4
    assert window.bench.settings.recent[0].endswith("mine.nexus")


def test_a_bad_file_is_a_message_and_nothing_else(open_studio, tmp_path, until):
    window = open_studio()
    bad = tmp_path / "bad.nexus"
    bad.write_text("{}")
    before = window.bench.document
    assert not window.bench.do("file.open", path=str(bad))
    assert window.bench.document is before
    assert "no project" in window.statusBar().children()[1].text() or window.bench.log.lines(
        "error"
    )
    damaged = tmp_path / "room.gnx"
    damaged.mkdir()
    (damaged / "scene.json").write_text("{")
    assert window.bench.do("file.open_scene", scene=str(damaged))
    until(lambda: window.bench.log.lines("error")[-1].text.startswith(str(damaged)))
    assert window.bench.do("file.room_lab")
    until(lambda: window.bench.scene is not None)


def test_a_script_plays_and_stops_at_its_first_failure(open_studio, until):
    from studio.app.shell.script_run import ScriptRun

    window = open_studio()
    steps = read_script(
        "view.theme name=light\nwait.seconds s=0.05\nview.theme name=pink\nview.theme name=dark",
        source="tour",
    )
    window.script = ScriptRun(window.bench, steps, source="tour", conditions={})
    until(lambda: window.script.is_done)
    assert window.bench.settings.theme == "light"
    assert str(window.script.failure).startswith("tour:3: theme = 'pink'")


def test_pictures_and_films_of_the_window(open_studio, tmp_path, until, monkeypatch):
    import av
    from PySide6.QtGui import QImage

    from studio.app.shell.window_film import WindowFilm

    window = open_studio()
    window.bench.do("window.picture", path=str(tmp_path / "a.png"))
    image = QImage(str(tmp_path / "a.png"))
    assert (image.width(), image.height()) == (window.width(), window.height())
    taken, take = [], WindowFilm._take
    monkeypatch.setattr(WindowFilm, "_take", lambda film: taken.append(take(film)))
    window.bench.do("window.film", path=str(tmp_path / "a.mp4"))
    until(lambda: len(taken) >= 3)
    window.bench.do("window.film")
    with av.open(str(tmp_path / "a.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) >= 3


@pytest.mark.parametrize("name", ["dark", "light"])
def test_text_meets_wcag_aa(name):
    from studio.app.shell.theme import THEMES

    def luminance(colour):
        values = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in values]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    def contrast(a, b):
        high, low = sorted((luminance(a), luminance(b)), reverse=True)
        return (high + 0.05) / (low + 0.05)

    theme = THEMES[name]
    for ground in (theme.ground, theme.panel, theme.field):
        for ink in ("text", "faint", "accent", "good", "warning", "bad", "calm"):
            assert contrast(getattr(theme, ink), ground) >= 4.5, (ink, ground)
    assert contrast(theme.on_accent, theme.accent) >= 4.5


def test_what_a_closed_recording_leaves_is_collected_once_nothing_plays(
    open_studio, monkeypatch, until
):
    from studio.app import window as module

    monkeypatch.setattr(module, "COLLECT_AFTER_MS", 1)
    collected = []
    monkeypatch.setattr(module, "give_back_memory", lambda: collected.append(1))
    window = open_studio()
    assert not window.run.is_busy
    window.bench.announce(Topic.RECORDING)
    until(lambda: collected)


def test_no_thread_collects_while_a_test_has_windows(qapp):
    assert not gc.isenabled()


def test_while_a_window_is_open_its_event_loop_alone_collects(monkeypatch, until):
    from studio.app import window as module

    monkeypatch.setattr(module, "COLLECT_MS", 1)
    by = []
    monkeypatch.setattr(module, "collect_due", lambda: by.append(threading.current_thread()))
    gc.enable()
    with module.collecting_between_events():
        assert not gc.isenabled()
        until(lambda: len(by) > 1)
    assert gc.isenabled()
    assert set(by) == {threading.main_thread()}


def test_a_closed_window_hears_of_no_change_any_more(open_studio, monkeypatch):
    from studio.app.shell import menus

    window = open_studio()
    refreshed = []
    monkeypatch.setattr(menus, "keys_of", lambda *_: refreshed.append(1) or "")
    monkeypatch.setattr(window, "setWindowTitle", lambda _title: refreshed.append(2))
    window.menus.refresh()
    assert refreshed
    window.close()
    refreshed.clear()
    window.bench.change("move", moved(window.bench, 0.4))
    window.bench.set(theme="light")
    window.bench.announce(Topic.RECORDING)
    assert refreshed == []
