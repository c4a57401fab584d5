"""An operator's way through the live panel, with a real stream on a real socket."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from devices.messages import Event
from scenes.state import TrackState
from studio.app.model.runs.live_run import Step
from studio.app.shell.theme import THEMES
from studio.console.display import why_no_window
from studio.session import opening
from tests.studio.live.conftest import LAYOUT
from tracking.options import TrackerOptions
from tracking.output import CameraMoment, CameraNotice

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def test_from_the_first_check_to_the_report_with_one_button(opened):
    head, dock = opened.dock.head, opened.dock
    assert head.next.text() == "Check and connect"
    assert not head.badge.isVisible()
    opened.go_live()
    opened.until(lambda: head.badge.isVisible() and head.next.text() == "End")
    assert re.fullmatch(r"LIVE 0:0\d:\d\d", head.badge.text())
    assert "● live" in head.state.text()
    assert not head.cancel.isVisible()
    # The twin follows the outputs, the thumbnail the camera, and the figures count.
    opened.until(lambda: not opened.bench.is_by_hand and opened.bench.camera_picture is not None)
    opened.until(lambda: not dock.camera.picture.pixmap().isNull())
    values = dock.camera.values
    opened.until(lambda: "MB" in values["Recording"].text())
    opened.until(lambda: int(values["Tracked"].text()) > 5)
    assert values["Last picture"].text().endswith("s ago")
    # The checks have come, each with a verdict, and of what is not good what to do.
    opened.until(lambda: dock.checks.topLevelItemCount() > 5)
    job = opened.live.job
    opened.until(lambda: job.checks[0].verdict == "PASS")
    assert [check.name for check in job.checks][:3] == ["camera", "stream", "light"]
    opened.until(lambda: opened.live.session.status().live_s > 1)
    head.next.click()
    opened.until(lambda: not opened.live.is_running)
    opened.until(lambda: "report is" in head.text.text())
    assert head.next.text() == "Check and connect"
    folder = job.plan.out
    assert folder.parent == opened.window.run.out
    report = json.loads((folder / "live.json").read_text())
    assert any(row["name"] == "live.frames" and row["value"] > 5 for row in report["rows"])
    assert (folder / "live.html").is_file()
    assert (folder / "preflight.json").is_file()
    assert dock.tabs.tabText(dock.tabs.currentIndex()) == "Report"
    assert "frames" in dock.report.toPlainText()
    # What was recorded is open in the timeline.
    timeline = opened.window.content("timeline")
    opened.until(lambda: timeline.is_open)
    assert opened.bench.recording == job.recording
    # Its time begins at 0 s, however long the camera was waited for.
    assert timeline.playback.start_ns > 0
    opened.until(lambda: "0.00 s of" in timeline.transport.time.text())
    opened.bench.do("timeline.seek", t_s=0.2)
    assert timeline.playback.t_ns == timeline.playback.start_ns + 200_000_000


def test_the_report_is_in_front_by_the_time_the_head_speaks_of_it(opened):
    opened.bench.stop_listening(opened.dock._on_session)  # as before the main thread comes to it
    opened.go_live()
    opened.bench.do("live.end")
    opened.until(lambda: "report is" in opened.dock.head.text.text())
    assert opened.dock.tabs.tabText(opened.dock.tabs.currentIndex()) == "Report"


def test_an_address_that_is_none_is_refused_in_words(opened):
    dock = opened.dock
    dock.page.address.setEditText("http://nowhere")
    assert "wanted a path that ends in .m3u8" in dock.page.line.text()
    dock.head.next.click()
    assert not opened.live.is_running
    assert "wanted a path that ends in .m3u8" in opened.window.line
    dock.page.address.setEditText("rtsp://127.0.0.1/x")
    assert "✖" not in dock.page.line.text()


def test_a_camera_that_does_not_answer_is_waited_for_and_cancelled(opened):
    opened.bench.do("live.use", address="rtsp://127.0.0.1:9/x", place="scan")
    dock = opened.dock
    dock.head.next.click()
    opened.until(lambda: "cannot be opened" in dock.head.text.text())
    assert "connecting" in dock.head.state.text()
    assert opened.live.step is Step.GO_LIVE_SOON
    begin = time.monotonic()
    dock.head.cancel.click()
    opened.until(lambda: not opened.live.is_running)
    assert time.monotonic() - begin < 10
    assert opened.live.step is Step.CHECK
    assert opened.bench.settings.cameras == ("rtsp://127.0.0.1:9/x",)


def test_a_doubtful_layout_is_looked_at_and_confirmed(opened):
    dock = opened.dock
    opened.use(layout=None)
    dock.head.next.click()
    opened.push()
    opened.until(lambda: opened.state() == "confirming" and "Confirm" in dock.head.next.text())
    assert dock.tabs.tabText(dock.tabs.currentIndex()) == "Camera"
    arrangement = dock.page.arrangement
    assert arrangement.isEnabled()
    arrangement.setCurrentIndex(arrangement.findData("stacked"))
    arrangement.activated.emit(arrangement.currentIndex())
    assert opened.live.shown_layout().arrangement == "stacked"
    arrangement.setCurrentIndex(arrangement.findData("side_by_side"))
    arrangement.activated.emit(arrangement.currentIndex())
    opened.until(lambda: dock.camera.picture.pixmap().width() > 200)
    dock.head.next.click()
    opened.until(lambda: opened.state() == "live")  # by that one press
    assert opened.live.session.layout == LAYOUT


def test_a_camera_that_vanishes_is_held_with_its_age_and_returns(opened):
    dock = opened.dock
    opened.go_live().close()
    opened.until(lambda: "held" in dock.head.state.text())
    assert dock.head.banner.isVisible()
    assert "objects stay where they were" in dock.head.banner_text.text()
    assert not dock.head.banner_button.isVisible()

    # Pictures that had come before are shown first, on a busy machine a while later.
    def age_s():
        return float(re.search(r"[0-9.]+", dock.camera.values["Last picture"].text()).group())

    opened.until(lambda: age_s() > 2)
    shown = dock.camera.picture.pixmap().cacheKey()
    opened.until(lambda: age_s() > 3)
    assert dock.camera.picture.pixmap().cacheKey() == shown
    assert opened.state() == "live"
    opened.push()
    opened.until(lambda: "● live" in dock.head.state.text())
    opened.until(lambda: not dock.head.banner.isVisible())
    opened.until(lambda: dock.camera.values["Gaps"].text().startswith("1"))


def test_settings_change_while_it_is_live_and_are_undone(opened):
    opened.go_live()
    session = opened.live.session
    opened.bench.do("tracker.set", texture=False)
    opened.until(lambda: session.options.texture is False)
    opened.dock.undo_button.click()
    assert session.options == TrackerOptions()
    opened.until(lambda: opened.bench.document.tracker.options == TrackerOptions())
    opened.bench.do("tracker.set", recover=False)
    opened.until(lambda: session.options.recover is False)
    opened.bench.do("edit.undo")
    opened.until(lambda: session.options == TrackerOptions())
    opened.bench.do("live.end")
    opened.until(lambda: not opened.live.is_running)
    changes = json.loads((opened.live.job.plan.out / "live.json").read_text())["changes"]
    assert len(changes) == 4


def test_a_lost_camera_has_a_button_that_looks_for_it(opened, monkeypatch):
    opened.go_live()
    session, head = opened.live.session, opened.dock.head
    relocation, searches = session._relocation, []
    monkeypatch.setattr(relocation, "start", lambda: searches.append(True))
    refused = Event(session.now_ns(), "session", "camera-refused", "the camera was not found: dark")
    monkeypatch.setattr(session, "events", lambda: (refused,))
    relocation.notice((CameraNotice(CameraMoment.NOT_FOUND),), session.now_ns())
    assert searches == [True]  # a lost camera is looked for without being asked, every 15 s
    opened.until(head.banner.isVisible)
    assert "The camera was not found: dark." in head.banner_text.text()
    assert "camera lost" in head.state.text()
    searches.clear()
    head.banner_button.click()
    assert searches == [True]
    placed = Event(session.now_ns(), "session", "camera-placed", "found")
    monkeypatch.setattr(session, "events", lambda: (refused, placed))
    relocation.notice((CameraNotice(CameraMoment.FOUND),), session.now_ns())
    opened.until(lambda: not head.banner.isVisible())


class Slow:
    """A tracker that takes 0.25 s a picture, and loses the chair after its tenth."""

    def __init__(self, tracker):
        self._tracker, self._count = tracker, 0

    def start(self):
        return self._tracker.start()

    def step(self, state, frame, now_ns):
        state, answer = self._tracker.step(state, frame, now_ns)
        self._count += 1
        time.sleep(0.25)
        tracks = tuple(
            replace(track, state=TrackState.LOST)
            if track.object_id == "chair-1" and self._count > 10
            else track
            for track in answer.objects
        )
        return state, replace(answer, objects=tracks)


def test_drops_are_coloured_with_their_cause_and_lost_objects_say_a_reason(
    opened, tiny, monkeypatch
):
    monkeypatch.setattr(
        opening, "make_method", lambda name, scene, *_, **__: Slow(tiny.tracker(0.0))
    )
    view, bench = opened.dock.camera, opened.bench
    opened.go_live()
    opened.until(lambda: view.cause.text())
    assert view.cause.text().startswith("This computer is too slow for ")
    assert "fewer or smaller pictures" in view.cause.text()
    bad = THEMES[bench.settings.theme].bad
    assert f"color: {bad}" in view.values["Dropped"].styleSheet()
    assert "%" in view.values["Dropped"].text()
    assert any(line.text == view.cause.text() for line in bench.log.lines("warning"))
    opened.until(lambda: "is lost" in opened.dock.head.text.text())
    assert "Chair 1 is lost: it" in opened.dock.head.text.text()
    opened.bench.do("live.end")
    opened.until(lambda: not opened.live.is_running)
    folder = opened.live.job.plan.out
    events = json.loads((folder / "live.json").read_text())["events"]
    assert sum("Chair 1 is lost" in event["text"] for event in events) == 1
    assert "This computer is too slow" in (folder / "live.html").read_text()


def test_a_simulated_camera_is_waited_for_in_its_own_words(opened, monkeypatch):
    """Its pictures are drawn first; nobody has to enter an address anywhere."""

    class Drawing:
        drawing, failure = "drawing lab-rearrange, once 12%", ""

        def __init__(self, *_args, **_more):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_error):
            pass

        def direct(self):
            pass

        def watch(self, _output):
            pass

        def rows(self, _result):
            return []

    monkeypatch.setattr("studio.live.rehearsed.RehearsedLive", Drawing)
    dock, timeline = opened.dock, opened.window.content("timeline")
    dock.page.simulated.click()
    dock.head.next.click()
    opened.until(lambda: "12%" in dock.head.text.text())
    assert "dock Live" in timeline.empty.words.text()
    assert "played and recorded" not in timeline.empty.words.text()
    job = opened.live.job
    opened.until(lambda: job.checks)
    camera = job.checks[0]
    assert camera.name == "camera"
    assert "made ready" in camera.what
    assert "by itself" in camera.fix
    assert "app" not in camera.fix
    dock.head.cancel.click()
    opened.until(lambda: not opened.live.is_running)


def test_closing_the_window_while_live_keeps_the_recording(opened):
    opened.go_live()
    job = opened.live.job
    recording = job.live.record_to
    begin = time.monotonic()
    opened.window.close()
    assert time.monotonic() - begin < 10
    assert not job.running
    assert recording.is_file()


def test_devices_are_saved_and_opened(opened, tmp_path):
    opened.bench.do("live.use", address="rtsp://me:secret@10.0.0.2/x", layout="stacked 90 90")
    path = tmp_path / "devices.toml"
    opened.bench.do("live.save_devices", path=str(path))
    opened.bench.do("live.use", address="udp://:5000", layout="auto", place="scan")
    opened.bench.do("live.open_devices", path=str(path))
    choice = opened.live.choice
    assert choice.address == "rtsp://me:secret@10.0.0.2/x"
    assert (choice.layout, choice.place) == ("stacked 90 90", "find")
    assert opened.dock.page.address.currentText() == choice.address
    assert "secret" not in opened.live.command()
    assert opened.live.command().startswith("nexus live tiny --headless --camera rtsp://10.0.0.2/x")


def test_the_camera_s_battery_is_coloured_and_asked_for_when_it_is_low(opened, monkeypatch):
    from devices.insta360.condition import CameraCondition

    opened.go_live()
    session, value = opened.live.session, opened.dock.camera.values["Camera"]
    assert value.text() == "–"  # this one pushes pictures and says nothing else
    said = SimpleNamespace(last=None, close=lambda: None)
    monkeypatch.setattr(session, "_condition", said)
    for battery, shown in ((0.64, "battery 64%"), (0.2, "▲ battery 20%"), (0.05, "battery 5%")):
        said.last = CameraCondition("Insta360 X4", "SIM1", "v1.4.6", battery, "pass", 0.0)
        opened.until(lambda shown=shown: value.text().endswith(shown))
    assert "Insta360 X4 v1.4.6" in value.toolTip()
    assert "plug it in" in opened.dock.head.banner_text.text()
