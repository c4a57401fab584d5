"""Every session has a folder of its own, a stopped one is kept, all give the twin back."""

import json
import threading
from dataclasses import replace

import pytest

from devices.messages import Event
from devices.recording import read_recording, read_session
from studio.app.model.standing import Mode
from studio.console.display import why_no_window
from studio.session.plan import SessionPlan
from studio.session.records.cut_short import KIND

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


class Held:
    """Frames of the tiny room of which the last ones wait until they may come."""

    def __init__(self, tiny, frames):
        self.go_on, self.reached, self._tiny, self._frames = (
            threading.Event(),
            threading.Event(),
            tiny,
            frames,
        )

    def __call__(self):
        for seq, message in enumerate(self._tiny.inputs()):
            if seq == self._frames:
                self.reached.set()
                self.go_on.wait(30)
            yield message


def folders(tmp_path):
    found = (tmp_path / "sessions").iterdir() if (tmp_path / "sessions").is_dir() else ()
    return sorted(path.name for path in found)


def is_usable(desk):
    """Whether the twin is the user's: an object follows the mouse, and physics would, too."""
    window, bench = desk.window, desk.window.bench
    before = bench.document
    is_moved = desk.drag_object("chair-1") and "chair-1" in bench.document.twin.poses
    assert window.content("twin").physics.why_not.startswith("this scene has no collision mesh")
    assert bench.document is not before or not is_moved
    return bench.standing.mode is Mode.EDITING and is_moved


def rehearsed(desk):
    """F5, and the recording at its end."""
    bench = desk.window.bench
    before = bench.recording
    desk.press("F5")
    desk.until(lambda: bench.recording not in (None, before) and not desk.window.run.is_busy)
    desk.until(lambda: desk.window.content("timeline").is_open)
    return bench.recording


def stopped(desk, tiny, frames=5):
    """F5, and Stop by its key after so many frames."""
    held = desk.options["inputs"] = Held(tiny, frames)
    desk.press("F5")
    desk.until(held.reached.is_set)
    desk.until(lambda: desk.window.bench.standing.mode is Mode.PLAYING)
    desk.press("F5", "Shift")
    held.go_on.set()
    desk.until(lambda: not desk.window.run.is_playing)


def close_recording(desk):
    dock = desk.window.content("timeline")
    desk.window.show_dock("timeline")
    desk.click(dock.transport.buttons["timeline.close"])


def test_two_rehearsals_have_two_folders_and_the_first_is_untouched(desk, tmp_path):
    first = rehearsed(desk)
    content = {path.name: path.read_bytes() for path in first.parent.iterdir()}
    second = rehearsed(desk)
    assert first != second
    assert len(folders(tmp_path)) == 2
    assert {path.name: path.read_bytes() for path in first.parent.iterdir()} == content
    assert folders(tmp_path)[0].endswith("_tiny_rehearsal")


def test_what_was_dragged_and_added_is_what_is_rehearsed(desk):
    from sim.scenarios.scenario import recorded_arrangement

    bench = desk.window.bench
    assert desk.drag_object("chair-1")
    desk.edit()
    rehearsed(desk)
    found = recorded_arrangement(desk.plans[-1].arranged, source="test")
    moved = bench.document.twin.poses["chair-1"]
    assert found.poses["chair-1"].matrix() == pytest.approx(moved.matrix(), abs=1e-6)
    assert [(item.object_id, item.kind) for item in found.added] == [("box-1", "box")]
    assert found.added[0].mass_kg == pytest.approx(150 * 0.3**3)


def test_after_its_end_the_recording_closes_by_its_button_and_the_twin_is_back(desk):
    rehearsed(desk)
    assert desk.window.bench.standing.mode is Mode.RECORDED
    assert not desk.drag_object("chair-1"), "the recording decides where objects are"
    close_recording(desk)
    assert is_usable(desk)


def test_stop_keeps_what_was_recorded_says_so_and_gives_the_twin_back(desk, tiny, tmp_path):
    window, bench = desk.window, desk.window.bench
    stopped(desk, tiny)
    assert is_usable(desk)
    (name,) = folders(tmp_path)
    folder = tmp_path / "sessions" / name
    recording = folder / "recording.mcap"
    last = next(v for v in read_recording(recording) if isinstance(v, Event) and v.kind == KIND)
    report = json.loads((folder / "report.json").read_text())
    assert report["cut_short"] == last.text == "stopped by the user after 0.5 s of 1.2 s"
    assert last.text in (folder / "report.html").read_text()
    assert "Cut short" in (folder / "report.html").read_text()
    # It opens by the notice that says so, and is listed as cut short.
    assert "kept" in window.problem.text
    window.problem.choose("Look at it")
    desk.until(lambda: bench.recording == recording)
    (line,) = window.content("sessions")._kept.values()
    assert line.cut_short
    close_recording(desk)
    assert is_usable(desk)


def test_what_was_cut_short_replays_to_the_same(desk, tiny, tmp_path):
    from studio.session.pipeline import recorded_messages

    stopped(desk, tiny)
    (name,) = folders(tmp_path)
    path = tmp_path / "sessions" / name / "recording.mcap"
    frames = [m.frame.seq for m in recorded_messages(path, read_session(path))]
    assert frames == list(range(6))
    again = tmp_path / "again.mcap"
    session = tiny.session(
        SessionPlan(methods=("own",), record_to=again),
        inputs=lambda: recorded_messages(path, read_session(path)),
    )
    assert session.run(lambda _output: None).frames == 6


def test_stopped_at_its_first_frame_it_gives_the_twin_back(desk, tiny):
    stopped(desk, tiny, frames=0)
    assert is_usable(desk)


def test_cancelled_while_its_room_is_opened_it_leaves_no_folder(desk, tiny, tmp_path, monkeypatch):
    from studio import rehearsal

    go_on = threading.Event()

    def slowly(plan, **given):
        go_on.wait(30)
        return tiny.session(plan, **given)

    monkeypatch.setattr(rehearsal, "open_session", slowly)
    desk.press("F5")
    desk.until(lambda: desk.window.run.is_playing)
    desk.press("F5", "Shift")
    go_on.set()
    desk.until(lambda: not desk.window.run.is_playing)
    assert folders(tmp_path) == []
    assert is_usable(desk)


@pytest.mark.parametrize("way", ["error", "replay"])
def test_every_other_end_gives_the_twin_back(desk, tiny, tmp_path, way):
    window, bench = desk.window, desk.window.bench

    def broken():
        inputs = tiny.inputs()
        yield next(inputs)
        yield next(inputs)
        raise ValueError("the camera fell over")

    if way == "error":
        desk.options["inputs"] = broken
        desk.press("F5")
        desk.until(lambda: window.problem.isVisible())
        assert "the camera fell over" in window.problem.text
    else:
        from studio.app.model.jobs.scene_job import SceneJob

        window.run.play(SceneJob(str(desk.room), SessionPlan(methods=("own",))))
    desk.until(lambda: not window.run.is_playing)
    assert bench.recording is None
    assert is_usable(desk)


def test_a_stopped_fork_comes_back_to_the_recording_it_was_made_of(desk, tiny, tmp_path):
    window, bench = desk.window, desk.window.bench
    original = rehearsed(desk)
    held = desk.options["inputs"] = Held(tiny, 9)
    scenario = tiny.scenario.replace("1.2", "2.0")
    bench.change("Longer", replace(bench.document, scenario=scenario, scenario_name="longer"))
    window.show_dock("timeline")
    bench.do("timeline.seek", t_s=0.5)
    desk.click(window.content("timeline").transport.buttons["timeline.fork"])
    desk.until(held.reached.is_set)
    assert bench.recording is None
    desk.press("F5", "Shift")
    held.go_on.set()
    desk.until(lambda: bench.recording == original)
    desk.until(lambda: window.content("timeline").is_open)
    folder = tmp_path / "sessions" / folders(tmp_path)[-1]
    report = json.loads((folder / "report.json").read_text())
    assert report["cut_short"]
    assert report["fork"]["t_ns"] == 500_000_000
    close_recording(desk)
    assert is_usable(desk)


def test_the_list_opens_deletes_and_brings_back(desk, tmp_path, monkeypatch):
    from PySide6.QtCore import Qt
    from PySide6.QtGui import QDesktopServices
    from PySide6.QtTest import QTest

    window, bench = desk.window, desk.window.bench
    first, second = rehearsed(desk), rehearsed(desk)
    close_recording(desk)
    bench.do("dock.sessions")
    dock = window.content("sessions")
    assert [kept.recording for kept in dock._kept.values()] == [second, first]
    table = dock.table
    below = table.visualItemRect(table.topLevelItem(1)).center()
    QTest.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=below)
    assert dock.chosen == first.parent
    shown = []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: shown.append(url.toLocalFile()))
    desk.click(dock.reveal_button)
    assert shown == [str(first.parent)]
    desk.click(dock.open_button)
    desk.until(lambda: bench.recording == first)
    desk.click(dock.delete_button)
    assert bench.recording is None
    assert not first.parent.exists()
    assert [kept.recording for kept in dock._kept.values()] == [second]
    desk.click(dock.undo_button)
    assert first.is_file()
    assert dock.chosen == first.parent
    desk.click(dock.delete_button)
    window.close()
    assert folders(tmp_path) == [second.parent.name]


def test_closing_the_window_while_a_session_plays_keeps_what_was_recorded(desk, tiny, tmp_path):
    held = desk.options["inputs"] = Held(tiny, 5)
    desk.press("F5")
    desk.until(held.reached.is_set)
    threading.Timer(0.2, held.go_on.set).start()
    desk.window.close()
    (name,) = folders(tmp_path)
    assert json.loads((tmp_path / "sessions" / name / "report.json").read_text())["cut_short"]
