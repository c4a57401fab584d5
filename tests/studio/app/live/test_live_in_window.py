"""`nexus live` with a display: it connects by itself, and the window's end is the session's."""

from __future__ import annotations

import time
import urllib.request

import pytest

from devices.camera.address import parse_address
from devices.clock import WallClock
from scenes.package import save_package
from studio.app.model.jobs.live_job import LivePlan
from studio.app.model.runs.live_run import LiveRun
from studio.console.display import why_no_window
from studio.live.people.hosting import Hosting
from studio.live.setup import LiveSetup, Place
from studio.session import opening
from tests.pushed_camera import RtmpPush, StreamOptions
from tests.studio.live.conftest import FPS, LAYOUT, textured

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def plan(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(opening, "make_method", lambda name, scene, *_, **__: tiny.tracker(0.0))
    save_package(tiny.scene, tmp_path / "room")

    def make(address, **more):
        setup = LiveSetup(parse_address(address), layout=LAYOUT, place=Place.SCAN, calibrates=False)
        return LivePlan(str(tmp_path / "room"), setup, tmp_path / "out", **more)

    return make


@pytest.fixture
def each_tick(qapp):
    """Calls back with the live run of the open window; four minutes at most."""
    from PySide6.QtCore import QTimer

    timer, since = QTimer(), time.monotonic()

    def arm(callback):
        def look():
            for window in [w for w in qapp.topLevelWidgets() if hasattr(w, "bench")]:
                if window.isVisible():
                    late = time.monotonic() - since > 240
                    if callback(window, window.bench.shared(LiveRun)) or late:
                        window.close()

        timer.timeout.connect(look)
        timer.start(20)

    yield arm
    timer.stop()


def test_it_connects_goes_live_and_ends_after_its_seconds(plan, each_tick, tmp_path):
    from studio.app.window import live_in_window

    pushes, joined = [], set()

    def drive(window, live):
        session = live.session
        if live.job is not None and live.job.hub is not None and session is not None:
            joined.add(live.job.hub.url)
        if session is not None and session.status().listening_at and not pushes:
            options = StreamOptions(fps=FPS, bitrate=2_000_000, keyframe_interval=5)
            url = session.status().listening_at
            pushes.append(RtmpPush(url, textured(), WallClock(), options=options))
        assert window.docks["live"].isVisible()
        return live.job is not None and live.job.report is not None

    each_tick(drive)
    try:
        assert (
            live_in_window(plan("rtmp://127.0.0.1:0/live/room", seconds=0.5, hosting=Hosting()))
            == 0
        )
    finally:
        for push in pushes:
            push.close()
    (folder,) = (tmp_path / "out").iterdir()  # every session has one of its own
    assert (folder / "live.html").is_file()
    assert list(folder.glob("live-*.mcap"))
    (url,) = joined
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(url, timeout=2)


def test_a_room_that_is_not_there_is_an_error_of_the_caller(plan, each_tick, tmp_path):
    from dataclasses import replace

    from studio.app.window import live_in_window

    each_tick(lambda window, live: live.job is not None and live.job.failure is not None)
    with pytest.raises(ValueError, match="nowhere"):
        live_in_window(replace(plan("udp://127.0.0.1:5999"), scene="nowhere"))
