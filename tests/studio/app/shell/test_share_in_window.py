"""Sharing by mouse: where to, what of it, and what it has come to."""

import pytest

from studio.console.display import why_no_window
from studio.handover.share import Part

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def rehearsed(desk, tiny, monkeypatch):
    monkeypatch.setattr("studio.handover.share.recorded_scene", lambda _info: tiny.scene)
    bench = desk.window.bench
    desk.press("F5")
    desk.until(lambda: bench.recording is not None and not desk.window.run.is_busy)
    desk.until(lambda: desk.window.content("timeline").is_open)
    return bench.recording.parent


def dialog(desk):
    from studio.app.shell.share_dialog import ShareDialog

    desk.press("E", "Control")
    desk.until(lambda: any(d.isVisible() for d in desk.window.findChildren(ShareDialog)), 10)
    return next(d for d in desk.window.findChildren(ShareDialog) if d.isVisible())


def test_place_and_content_are_chosen_and_the_folder_is_one_click_away(
    desk, rehearsed, tmp_path, monkeypatch
):
    from PySide6.QtGui import QDesktopServices
    from PySide6.QtTest import QTest

    window, opened = desk.window, []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: opened.append(url.toLocalFile()))
    asked = dialog(desk)
    assert asked.place.text() == str(rehearsed.with_name(f"{rehearsed.name}-shared"))
    assert set(asked.parts) == set(Part)
    asked.place.selectAll()
    QTest.keyClicks(asked.place, str(tmp_path / "for Ana"))
    for name in ("viewer", "archive"):
        desk.click(asked.parts[name])
    desk.click(asked.make)
    desk.until(lambda: window.problem.isVisible() and not window.run.is_sharing)
    folder = tmp_path / "for Ana"
    assert sorted(p.name for p in folder.iterdir()) == [
        "pictures",
        "rehearsal.mp4",
        "session-sheet.html",
        "session-sheet.md",
    ]
    assert str(folder) in window.problem.text
    assert "session-sheet.html" in window.problem.text
    assert any("share.make" in line and "for Ana" in line for line in window.bench.trace())
    window.problem.choose("Open folder")
    assert opened == [str(folder)]


def test_a_recording_that_was_cut_off_says_so_in_the_timeline_and_when_shared(
    desk, rehearsed, tmp_path
):
    """Its last bytes are missing, as a full disk or a crash leaves it."""
    recording, bench = rehearsed / "recording.mcap", desk.window.bench
    timeline = desk.window.content("timeline")
    assert "cut off" not in timeline.transport.time.text()
    recording.write_bytes(recording.read_bytes()[:-30])
    desk.window.show_dock("timeline")
    desk.click(timeline.transport.buttons["timeline.close"])
    bench.do("timeline.open", path=str(recording))
    desk.until(lambda: timeline.is_open and "(cut off)" in timeline.transport.time.text(), 20)
    assert "shown as far as it goes" in desk.window.problem.text
    bench.do("share.make", out=str(tmp_path / "cut"), parts=["sheet"])
    desk.until(lambda: not desk.window.run.is_sharing)
    assert "the recording was cut off" in desk.window.problem.text
    assert "the recording was cut off" in (tmp_path / "cut" / "session-sheet.md").read_text()


def test_nothing_chosen_or_cancelled_makes_nothing(desk, rehearsed):
    asked = dialog(desk)
    for box in asked.parts.values():
        desk.click(box)
    assert not asked.make.isEnabled()
    desk.click(asked.buttons.button(asked.buttons.StandardButton.Cancel))
    assert not asked.isVisible()
    assert not desk.window.run.is_sharing
    assert [p.name for p in rehearsed.parent.iterdir()] == [rehearsed.name]
