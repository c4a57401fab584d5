import json
import shutil

import numpy as np
import pytest

from devices.recording import Recorder, read_session
from devices.replay import ReplayCamera
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.console.display import why_no_window
from studio.console.rows import Row, as_json

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def bench(qapp, tiny):
    from studio.app.shell.history import QtHistory

    made = Workbench(Document("tiny"), Settings(), QtHistory(lambda d: made.show_document(d)))
    made.show_scene(tiny.scene)
    return made


@pytest.fixture
def dock(bench):
    from studio.app.timeline.actions import make_timeline

    made = make_timeline(bench)
    made.resize(1000, 320)
    made.show()
    yield made
    made.close()
    made.deleteLater()


@pytest.fixture
def opened(dock, bench, recording, until):
    assert bench.do("timeline.open", path=str(recording))
    until(lambda: dock.playback is not None)
    return dock


def test_a_seek_shows_the_room_and_the_picture_of_that_instant(opened, bench, recording, until):
    frames = list(ReplayCamera(recording).frames())
    assert bench.do("timeline.seek", t_s=0.75)
    assert bench.state.objects["chair-1"].source_seq == 7
    until(lambda: np.array_equal(bench.camera_picture, frames[7].images[0]))


def test_listeners_look_again_once_it_can_be_played(dock, bench, recording, until):
    from studio.app.model.workbench import Topic

    seen = []
    action = bench.actions.get("timeline.play")
    bench.listen(Topic.RECORDING, lambda: seen.append(action.is_available))
    assert not action.is_available
    bench.do("timeline.open", path=str(recording))
    until(lambda: dock.playback is not None)
    assert seen
    assert seen[-1]


def test_it_plays_to_the_end_and_steps(opened, bench, until):
    bench.do("timeline.faster")
    bench.do("timeline.play")
    until(lambda: not opened.playback.is_playing and opened.playback.t_ns > 0)
    bench.do("timeline.step_back")
    until(lambda: bench.state.objects["chair-1"].source_seq == 10)


def test_a_mark_is_one_step_of_undo_and_can_be_reached(opened, bench):
    bench.do("timeline.mark", text="here", t_s=0.5)
    assert [m.text for m in bench.document.markers] == ["here"]
    bench.do("timeline.next")
    assert opened.playback.t_ns == 300_000_000  # the push
    bench.do("timeline.next")
    assert opened.playback.t_ns == 500_000_000
    bench.history.undo()
    assert not bench.document.markers


def test_a_drag_scrubs(opened, bench, qtbot):
    from PySide6.QtCore import QPoint, Qt

    tracks = opened.tracks
    x = round(tracks.x_of(650_000_000))
    qtbot.mousePress(tracks, Qt.MouseButton.LeftButton, pos=QPoint(x, 10))
    qtbot.mouseRelease(tracks, Qt.MouseButton.LeftButton, pos=QPoint(x, 10))
    assert bench.state.objects["chair-1"].source_seq == 6
    assert "timeline.seek" in bench.trace()[-1]


def test_what_is_under_the_mouse_is_read_out(opened):
    opened._on_hover(650_000_000, "chair-1")
    text = opened.read_out.text()
    assert "Chair 1 occluded" in text
    assert "3.0 cm" in text


def test_while_the_picture_is_of_another_instant_its_time_is_shown(opened, bench, until):
    until(lambda: bench.camera_picture is not None and opened.viewing._taken_ns == 0)
    assert "picture of" not in opened.transport.time.text()
    bench.do("timeline.seek", t_s=0.75)
    assert "picture of 0.00 s" in opened.transport.time.text()
    until(lambda: "picture of" not in opened.transport.time.text())
    assert opened.viewing._taken_ns == 700_000_000


def test_curves_show_the_part_that_the_rows_show(opened, bench):
    plot = opened.curves._plot
    bench.do("timeline.seek", t_s=0.4)
    for unit in ("heading\noff by, °", "place\noff by, cm"):
        bench.do("timeline.yaw")
        opened.tracks.zoom(0.5, 400_000_000)
        low, high = plot.getViewBox().viewRange()[0]
        span_s = opened.tracks.from_ns / 1e9, opened.tracks.to_ns / 1e9
        assert (low, high) == pytest.approx(span_s)
        assert opened.curves.unit.text() == unit
        assert opened.curves._line.value() == pytest.approx(0.4)


def test_a_damaged_recording_leaves_a_message(dock, bench, recording, tmp_path, until):
    damaged = tmp_path / "cut.mcap"
    damaged.write_bytes(recording.read_bytes()[:5000])
    bench.do("timeline.open", path=str(damaged))
    until(lambda: bench.log.lines())
    assert "cut off" in bench.log.lines()[-1].text
    assert bench.notice.text == bench.log.lines()[-1].text
    assert bench.recording is None
    assert dock.playback is None


def test_a_recording_that_cannot_be_read_leaves_the_open_one_as_it_was(
    opened, bench, recording, tmp_path, until
):
    bench.do("timeline.seek", t_s=0.4)
    shown, before = opened.shown, bench.state.objects
    damaged = tmp_path / "cut.mcap"
    damaged.write_bytes(recording.read_bytes()[:5000])
    bench.do("timeline.open", path=str(damaged))
    until(lambda: bench.notice is not None and opened.viewing.share is None)
    assert (bench.recording, opened.shown) == (recording, shown)
    assert bench.state.objects is before
    assert opened.playback.t_ns == 400_000_000
    assert str(damaged) not in bench.settings.recent_sessions


def test_an_empty_recording_leaves_a_message(dock, bench, recording, tmp_path, until):
    path = tmp_path / "empty.mcap"
    with Recorder(path, read_session(recording)):
        pass
    bench.do("timeline.open", path=str(path))
    until(lambda: bench.log.lines())
    assert bench.recording is None
    assert "empty recording" in bench.log.lines()[-1].text


def test_while_a_session_plays_the_empty_page_offers_to_stop_it(dock, bench):
    from types import SimpleNamespace

    from studio.app.model.workbench import Topic

    assert not dock.empty.buttons["session.rehearse"].isHidden()
    assert dock.empty.buttons["session.stop"].isHidden()
    bench.session = SimpleNamespace(is_playing=True)
    bench.announce(Topic.SESSION)
    assert dock.empty.buttons["session.rehearse"].isHidden()
    assert not dock.empty.buttons["session.stop"].isHidden()
    assert "being played" in dock.empty.words.text()


def test_a_foreign_recording_is_shown_and_says_so(dock, bench, recording, tiny, until):
    from dataclasses import replace

    bench.show_scene(replace(tiny.scene, name="other", objects=()))
    bench.do("timeline.open", path=str(recording))
    until(lambda: dock.playback is not None)
    assert any("recorded in scene 'tiny'" in line.text for line in bench.log.lines())
    assert set(bench.state.objects) <= {"chair-1", "stool-1"}


def test_a_fork_of_what_cannot_be_forked_is_a_message(opened, bench):
    assert not bench.do("timeline.fork", t_s=0.5)
    assert "fork" in bench.log.lines()[-1].text


def test_two_runs_are_compared_in_a_table(
    opened, bench, recording, tmp_path, until, monkeypatch, tiny
):
    monkeypatch.setattr("studio.compare.comparison.recorded_scene", lambda info: tiny.scene)
    for name, error_cm in (("a", 3.0), ("b", 9.0)):
        folder = tmp_path / name
        folder.mkdir()
        shutil.copy(recording, folder / "recording.mcap")
        rows = [
            Row("chair.world_cm", error_cm, "cm"),
            Row("rehearse.object.chair-1.world_cm.p95", 2.0, "cm"),
        ]
        (folder / "report.json").write_text(json.dumps(as_json("rehearse", rows, 0)))
    bench.do("timeline.compare", a=str(tmp_path / "a"), b=str(tmp_path / "b"))
    until(lambda: opened.comparison is not None)
    model = opened.view.table.model()
    cells = [model.index(0, column).data() for column in range(model.columnCount())]
    assert cells == ["chair, place", "3.000", "9.000", "+6.000", "cm", "✖ worse"]
    assert model.index(1, 0).data() == "Chair 1, place, 95 %"  # names, no ids


@pytest.fixture
def two_folders(recording, tmp_path, monkeypatch, tiny):
    """Two runs of which B is a copy of A."""
    monkeypatch.setattr("studio.compare.comparison.recorded_scene", lambda info: tiny.scene)
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        shutil.copy(recording, folder / "recording.mcap")
        rows = [Row("chair.world_cm", 3.0, "cm")]
        (folder / "report.json").write_text(json.dumps(as_json("rehearse", rows, 0)))
    return {name: str(tmp_path / name) for name in ("a", "b")}


@pytest.fixture
def compared(opened, bench, two_folders, until):
    """Both compared, with a recording open."""
    bench.do("timeline.compare", **two_folders)
    until(lambda: opened.comparison is not None)
    return opened


def test_two_runs_can_be_compared_with_no_recording_open(dock, bench, two_folders, until):
    bench.do("timeline.compare", **two_folders)
    until(lambda: dock.comparison is not None)
    assert dock.view.isVisible()
    assert bench.do("timeline.seek", t_s=0.5)
    assert dock.view.playback.t_ns == 500_000_000


@pytest.fixture
def held(monkeypatch):
    """Comparisons that end when `held.go` is set; `held.begun` has their folders."""
    import threading
    from types import SimpleNamespace

    from studio.compare import comparison

    made, read = SimpleNamespace(begun=[], go=threading.Event()), comparison.read_comparison

    def read_held(a, b, **options):
        made.begun.append((a.name, b.name))
        assert made.go.wait(60)
        return read(a, b, **options)

    monkeypatch.setattr(comparison, "read_comparison", read_held)
    yield made
    made.go.set()


def test_a_fork_that_ends_during_a_comparison_is_compared_after_it(
    dock, bench, recording, two_folders, held, until, tmp_path
):
    a, b = two_folders["a"], two_folders["b"]
    dock.runs._pair = (tmp_path / "b", tmp_path / "a")  # A's recording is what a fork has left
    assert bench.do("timeline.compare", a=a, b=b)
    until(lambda: held.begun)
    bench.do("timeline.open", path=str(tmp_path / "a" / "recording.mcap"))
    until(lambda: dock.is_open)
    assert "begins when" in bench.log.lines()[-1].text
    held.go.set()
    until(lambda: len(held.begun) == 2 and dock.view.isVisible() and dock.runs._comparing is None)
    assert held.begun == [("a", "b"), ("b", "a")]
    assert dock.comparison.a.folder == tmp_path / "b"


def test_what_is_being_compared_is_not_compared_twice(dock, bench, two_folders, held, until):
    assert bench.do("timeline.compare", **two_folders)
    assert bench.do("timeline.compare", **two_folders)
    assert "being compared already" in bench.log.lines()[-1].text
    held.go.set()
    until(lambda: dock.comparison is not None and dock.runs._comparing is None)
    assert len(held.begun) == 1


def test_both_runs_are_pictured_at_one_instant(compared, bench, until):
    pictures = compared.view.beside.pictures
    until(lambda: all(each.has_picture for each in pictures))
    before = [each.grab().toImage() for each in pictures]
    assert bench.do("timeline.seek", t_s=1.1)
    assert {each._t_ns for each in pictures} == {1_100_000_000}
    assert compared.view.slider.value() == 110
    assert "off by at most" in pictures[0].caption
    until(lambda: all(a.grab().toImage() != b for a, b in zip(pictures, before, strict=True)))
    bench.do("timeline.step_back")
    assert compared.view.playback.t_ns == 1_000_000_000
    # One clock: the recording below, and all that the window shows of it, goes along.
    until(lambda: compared.playback.t_ns == 1_000_000_000)
    assert bench.state.objects["chair-1"].source_seq == 10


def test_runs_are_captioned_by_the_names_of_the_rest_of_the_window(compared, bench, tiny):
    from dataclasses import replace

    one, _ = compared.view.beside.pictures
    assert any(f"({item.name})" in one.caption for item in tiny.scene.objects)
    names = {item.object_id: f"My {item.object_id[:3]}" for item in tiny.scene.objects}
    document = bench.document
    bench.change("Rename", replace(document, twin=replace(document.twin, names=names)))
    assert "(My " in one.caption


def test_turning_one_run_turns_both(compared, qtbot):
    from PySide6.QtCore import QPoint, Qt

    one, other = compared.view.beside.pictures
    orbit = one.orbit
    qtbot.mousePress(one, Qt.MouseButton.LeftButton, pos=QPoint(20, 40))
    qtbot.mouseMove(one, QPoint(60, 40))
    qtbot.mouseRelease(one, Qt.MouseButton.LeftButton, pos=QPoint(60, 40))
    assert one.orbit == other.orbit
    assert one.orbit.yaw != orbit.yaw


def test_leaving_a_comparison_goes_back_to_the_recording(compared, bench):
    compared._leave_comparison()
    assert compared.view.playback is None
    assert bench.do("timeline.seek", t_s=0.5)
    assert compared.playback.t_ns == 500_000_000


def test_what_cannot_be_compared_is_a_message(dock, bench, tmp_path, until):
    bench.do("timeline.compare", a=str(tmp_path), b=str(tmp_path / "none"))
    until(lambda: bench.log.lines())
    assert "report.json" in bench.log.lines()[-1].text
