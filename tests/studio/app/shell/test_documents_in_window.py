"""No edit is lost without a question, and nothing replaces what is open before it is read."""

import os
from dataclasses import replace

import pytest

from scenes.formats.registry import write_splats
from scenes.package import save_package
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import load_document, save_document
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def other_room(tiny, tmp_path):
    path = tmp_path / "other.gnx"
    save_package(replace(tiny.scene, name="other"), path)
    return path


def close_by_frame(window):
    """As the ✕ of the window's frame does."""
    window.windowHandle().close()


def ways_out(desk, other_room, tmp_path):
    """Every way to leave the document that is open, by hand, and whether it has been left."""
    from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
    from PySide6.QtGui import QDropEvent

    window = desk.window
    project = tmp_path / "another.nexus"
    save_document(Document(str(other_room), seed=9), project)
    window.bench.remember(str(other_room))

    def open_by_keys():
        desk.choose_file(project)
        desk.press("O", "Control")

    def by_drop():
        data = QMimeData()
        data.setUrls([QUrl.fromLocalFile(str(project))])
        window.dropEvent(
            QDropEvent(
                QPointF(9, 9),
                Qt.DropAction.CopyAction,
                data,
                Qt.MouseButton.LeftButton,
                Qt.KeyboardModifier.NoModifier,
            )
        )

    def built_in():
        window.menus.qt_action("file.room_desk").trigger()

    return {
        "Ctrl+O": open_by_keys,
        "drop": by_drop,
        "built-in": built_in,
        "new": lambda: desk.press("N", "Control"),
        "✕": lambda: close_by_frame(window),
        "Ctrl+Q": lambda: desk.press("Q", "Control"),
    }


@pytest.mark.parametrize("way", ["Ctrl+O", "drop", "built-in", "new", "✕", "Ctrl+Q"])
def test_cancel_keeps_document_undo_and_room(desk, other_room, tmp_path, way):
    bench = desk.window.bench
    desk.edit()
    document, scene = bench.document, bench.scene
    ways_out(desk, other_room, tmp_path)[way]()
    desk.answer("Cancel")
    assert desk.window.isVisible()
    assert (bench.document, bench.scene) == (document, scene)
    assert not bench.is_saved
    desk.press("Z", "Control")
    assert not bench.document.twin.primitives
    assert bench.is_saved, "undo came back to what was opened"


def test_discard_opens_the_other_with_its_own_undo_and_autosave(desk, other_room, tmp_path):
    bench = desk.window.bench
    desk.edit()
    desk.until(lambda: list((tmp_path / "home").glob("autosave-*.nexus")))
    (first,) = (tmp_path / "home").glob("autosave-*.nexus")
    ways_out(desk, other_room, tmp_path)["Ctrl+O"]()
    desk.answer("Discard")
    desk.until(lambda: bench.document.seed == 9)
    assert bench.scene.name == "other"
    assert not first.exists()
    desk.press("Z", "Control")
    assert bench.document.seed == 9, "undo belongs to the document"
    desk.edit()
    desk.until(lambda: list((tmp_path / "home").glob("autosave-*.nexus")))
    (second,) = (tmp_path / "home").glob("autosave-*.nexus")
    assert second != first


def test_save_asks_for_a_file_writes_it_and_goes_on(desk, other_room, tmp_path):
    bench = desk.window.bench
    desk.edit()
    close_by_frame(desk.window)
    desk.until(lambda: desk.question() is not None)
    desk.choose_file(tmp_path / "mine")
    desk.answer("Save")
    desk.until(lambda: not desk.window.isVisible())
    assert load_document(tmp_path / "mine.nexus").twin.primitives.keys() == {"box-1"}
    assert not list((tmp_path / "home").glob("autosave-*.nexus"))
    assert bench.is_saved


def test_a_document_without_unsaved_edits_goes_without_a_question(desk, other_room, tmp_path):
    ways_out(desk, other_room, tmp_path)["drop"]()
    desk.until(lambda: desk.window.bench.document.seed == 9)
    assert desk.question() is None


def test_edits_that_are_made_while_the_other_room_is_read_are_asked_about(
    desk, other_room, tmp_path, monkeypatch
):
    import threading

    from scenes import opening

    go_on, read = threading.Event(), opening.open_scene

    def slowly(scene):
        go_on.wait(30)
        return read(scene)

    monkeypatch.setattr(opening, "open_scene", slowly)
    bench = desk.window.bench
    desk.edit()
    ways_out(desk, other_room, tmp_path)["drop"]()
    desk.answer("Discard")
    desk.until(lambda: desk.window.run.is_busy)
    desk.edit()
    go_on.set()
    desk.answer("Cancel")
    assert bench.document.twin.primitives.keys() == {"box-1", "box-2"}
    assert bench.scene.name == "tiny"


def damaged_files(tiny, room, tmp_path):
    """Files that end early, one of each kind."""
    for name in ("room.ply", "room.spz"):
        write_splats(tmp_path / name, tiny.scene.room)
        whole = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(whole[: len(whole) // 2])
    package = tmp_path / "cut.gnx"
    save_package(tiny.scene, package)
    (package / "scene.json").write_bytes((package / "scene.json").read_bytes()[:100])
    (tmp_path / "cut.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(40))
    return {name: tmp_path / name for name in ("room.ply", "room.spz", "cut.gnx", "cut.mcap")}


@pytest.mark.parametrize("name", ["room.ply", "room.spz", "cut.gnx", "cut.mcap"])
def test_a_file_that_ends_early_leaves_all_as_it_was_and_says_why(desk, tiny, tmp_path, name):
    window, bench = desk.window, desk.window.bench
    path = damaged_files(tiny, desk.room, tmp_path)[name]
    view = window.view.active
    desk.until(lambda: view.painted is not None and view.painted.is_full)
    before = bench.document, bench.scene, bench.state, bench.settings, view.viewer
    if path.is_dir():
        bench.do("file.drop", paths=[str(path)])
    else:
        desk.choose_file(path)
        desk.press("O", "Control")
    desk.until(lambda: window.problem.isVisible())
    assert path.name in window.problem.text or "scene.json" in window.problem.text
    assert (bench.document, bench.scene, bench.state, bench.settings, view.viewer) == before
    assert bench.is_by_hand
    assert window.windowTitle().startswith("tiny.gnx")
    window.problem.choose("Close")
    assert not window.problem.isVisible()
    desk.edit()
    assert bench.document.twin.primitives


def test_work_of_two_documents_is_offered_after_a_crash_each_by_itself(desk, other_room, tmp_path):
    """A script asks nobody: what it leaves unsaved stays kept beside what comes after it."""
    from studio.app.model.documents.autosave import recoverable
    from studio.app.model.script import Step
    from studio.app.shell.script_run import ScriptRun

    window, bench, home = desk.window, desk.window.bench, tmp_path / "home"
    desk.edit()
    window.script = ScriptRun(
        bench,
        [
            Step(1, "file.open_scene", {"scene": str(other_room)}),
            Step(2, "wait.seconds", {"s": 60}),
        ],
        source="test",
        conditions={},
    )
    desk.until(lambda: bench.scene.name == "other")
    desk.edit()
    desk.until(lambda: len(list(home.glob("autosave-*.nexus"))) == 2)
    assert recoverable(home) == [], "this process is at work still"
    for path in home.glob("autosave-*.nexus"):  # as a process that is gone would have named them
        path.rename(home / path.name.replace(f"-{os.getpid()}-", "-999999999-"))
    rooms = {item.document.scene for item in recoverable(home)}
    assert rooms == {str(desk.room), str(other_room)}
    window.script = None


def test_restoring_goes_on_with_the_project_it_was_of(desk, tmp_path):
    from studio.app.model.documents.autosave import Autosave

    home, project = tmp_path / "home", tmp_path / "mine.nexus"
    document = Document(str(desk.room), seed=4)
    save_document(document, project)
    kept = Autosave(home, pid=999_999_999)
    kept.keep(replace(document, seed=5), project)
    kept.stop(keep=True)
    desk.window.close()
    desk.window = desk.window_on(Document(str(desk.room)))
    desk.until(lambda: desk.window.notice.isVisible())
    assert "mine" in desk.window.notice.text
    desk.window.notice.choose("Restore")
    desk.until(lambda: desk.window.bench.project == project)
    assert not desk.window.bench.is_saved
    desk.press("S", "Control")
    desk.until(lambda: desk.window.bench.is_saved)
    assert load_document(project).seed == 5


def test_what_was_set_for_one_room_does_not_stay_in_another(desk, other_room):
    """Neither the tracker's settings nor the errors that a fault had."""
    from studio.app.scenario.faults.knobs import CHANGED_SINCE, NOTHING_TRIED
    from studio.app.scenario.faults.trial import ObjectError, TrialResult
    from tracking.options import TrackerOptions

    window, bench = desk.window, desk.window.bench
    bench.do("dock.scenario")
    knobs = window.content("scenario").knobs
    window.content("scenario").tabs.setCurrentWidget(knobs)
    bench.do("scenario.choose", name="lab-short")
    errors = {"chair-1": ObjectError(2.0, 1.0, 0.0, True)}
    knobs.trials.start = lambda plan: knobs.trials.results.put(TrialResult(errors, 1.0))
    desk.click(knobs._start)
    desk.until(lambda: knobs.bars.isVisible())
    assert "mean errors" in knobs.state.text()
    bench.do("scenario.text", text=f"{bench.document.scenario}# changed\n")
    assert knobs.state.text() == CHANGED_SINCE
    assert not knobs.bars.isEnabled()
    desk.press("Z", "Control")
    assert "mean errors" in knobs.state.text()
    assert bench.do("tracker.set", texture=False)
    bench.do("file.drop", paths=[str(other_room)])
    desk.answer("Discard")
    desk.until(lambda: bench.scene.name == "other")
    assert bench.document.tracker.options == TrackerOptions()
    assert knobs.state.text() == NOTHING_TRIED
    assert not knobs.bars.isVisible()


def test_a_corner_that_is_off_its_plane_keeps_the_other_picks_and_the_red_line_goes(desk):
    import numpy as np
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    from studio.app.viewport.by_hand.tools import Tool

    window, bench = desk.window, desk.window.bench
    view = window.view.active
    desk.until(lambda: view.painted is not None)
    bench.do("view.tool_surface")
    picks = ((-0.4, 0.3, 0.0), (0.4, 0.3, 0.0), (0.4, -0.3, 0.6))
    for pick in picks:
        view.hand = view.hand.picked(np.array(pick))
    rows, columns = np.nonzero(view.painted.depth)  # the last one by the mouse, on the floor
    scale = view.width() / view.painted.depth.shape[1]
    floor = len(rows) // 2
    at = QPoint(round(columns[floor] * scale), round(rows[floor] * scale))
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=at)
    assert view.hand.tool is Tool.SURFACE
    assert [tuple(place) for place in view.hand.places] == list(picks)
    assert window.line.startswith("✖")
    assert "click the last corner again" in window.line
    QTest.keyClick(view, Qt.Key.Key_Backspace)
    assert len(view.hand.places) == 2
    desk.edit()
    assert not window.line.startswith("✖")
