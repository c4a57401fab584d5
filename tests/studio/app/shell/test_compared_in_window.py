"""Forks and comparisons by mouse and keys: said at once, one clock, pictures at full size."""

import json
import shutil
from dataclasses import replace

import pytest

from studio.console.display import why_no_window
from studio.console.rows import Row, as_json

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def go_on_with(desk, text):
    bench = desk.window.bench
    document = replace(bench.document, scenario=text, scenario_name="other")
    bench.change("Edit the scenario", document)


def fork_here(desk):
    desk.window.show_dock("timeline")
    desk.click(desk.window.content("timeline").transport.buttons["timeline.fork"])


@pytest.fixture
def rehearsed(desk):
    """Its recording, open at 0.5 s."""
    bench = desk.window.bench
    desk.press("F5")
    desk.until(lambda: bench.recording is not None and not desk.window.run.is_busy)
    desk.until(lambda: desk.window.content("timeline").is_open)
    assert bench.do("timeline.seek", t_s=0.5)
    return bench.recording


def test_a_fork_that_changes_nothing_says_so_at_once_and_plays_if_wanted(desk, tiny, rehearsed):
    window, bench = desk.window, desk.window.bench
    late = tiny.scenario + "[faults]\nblur = { px = 4.0, from_s = 5.0 }\n"
    go_on_with(desk, late)
    fork_here(desk)
    desk.until(window.problem.isVisible)
    assert "would play the same session once more" in window.problem.text
    assert "the end at 1.2 s" in window.problem.text
    assert bench.recording == rehearsed
    assert not window.run.is_playing
    assert len(list(rehearsed.parent.parent.iterdir())) == 1
    window.problem.choose("Fork all the same")
    desk.until(lambda: bench.recording not in (None, rehearsed))
    assert desk.plans[-1].fork.t_ns == 500_000_000


def test_a_change_after_the_instant_is_forked_without_a_question(desk, tiny, rehearsed):
    bench = desk.window.bench
    go_on_with(desk, tiny.scenario + "[faults]\nblur = { px = 4.0, from_s = 0.7 }\n")
    fork_here(desk)
    desk.until(lambda: bench.recording not in (None, rehearsed))
    assert not desk.window.problem.isVisible()


def test_two_runs_fill_the_view_at_one_instant(desk, tiny, rehearsed, tmp_path, monkeypatch):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    window, bench = desk.window, desk.window.bench
    monkeypatch.setattr("studio.compare.comparison.recorded_scene", lambda info: tiny.scene)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        shutil.copy(rehearsed, tmp_path / name / "recording.mcap")
        rows = [Row("chair.world_cm", 3.0, "cm")]
        (tmp_path / name / "report.json").write_text(json.dumps(as_json("rehearse", rows, 0)))
    window.show_dock("timeline")
    dock, room = window.content("timeline"), window.view.active.height()
    bench.do("timeline.compare", a=str(tmp_path / "a"), b=str(tmp_path / "b"))
    desk.until(lambda: dock.view.isVisible())
    one, other = dock.view.beside.pictures
    desk.until(lambda: one.has_picture and other.has_picture)
    assert not window.view.active.isVisible()
    assert one.height() >= room
    assert one.width() + other.width() >= window.view.width() - 10
    slider = dock.view.slider
    QTest.mouseClick(slider, Qt.MouseButton.LeftButton, pos=QPoint(slider.width() - 3, 8))
    desk.until(lambda: dock.view.playback.t_ns > 600_000_000)
    desk.until(lambda: dock.playback.t_ns == dock.view.playback.t_ns)
    assert {one._t_ns, other._t_ns} == {dock.playback.t_ns}
    assert bench.state.t_ns <= dock.playback.t_ns < bench.state.t_ns + 100_000_000
    desk.click(dock.view.back)
    assert window.view.active.isVisible()
    assert not one.isVisible()
    # A session needs the view: a comparison gives way to it, also with no recording open.
    bench.do("timeline.compare", a=str(tmp_path / "a"), b=str(tmp_path / "b"))
    desk.until(lambda: dock.view.isVisible())
    desk.press("F5")
    desk.until(lambda: window.view.active.isVisible())
    desk.until(lambda: not window.run.is_busy)
