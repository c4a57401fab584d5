"""The window on the tiny room, and a real camera that pushes to its live session."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

from devices.camera.address import parse_address
from devices.clock import WallClock
from studio.app.model.documents.document import Document
from studio.app.model.runs.live_run import LiveRun
from studio.live.setup import LiveSetup, Place
from studio.session import opening
from tests.pushed_camera import RtmpPush, StreamOptions
from tests.studio.live.conftest import FPS, LAYOUT, textured

PUSHED = "rtmp://127.0.0.1:0/live/room"


@pytest.fixture
def opened(tiny, tmp_path, qapp, monkeypatch):
    """`opened.window`, its `live` run and `dock`; `push` streams to it; `until` lets Qt work."""
    from studio.app.window import dispose, make_window

    monkeypatch.setattr(opening, "make_method", lambda name, scene, *_, **__: tiny.tracker(0.0))
    window = make_window(
        Document("tiny"), rehearse_to=tmp_path / "out" / "rehearsal", home=tmp_path / "home"
    )
    window.bench.set(has_started=True)
    window.show()

    def until(condition, seconds=120.0):
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, [line.text for line in window.bench.log.lines()]
            qapp.processEvents()
            time.sleep(0.002)

    until(lambda: window.is_filled)
    window.bench.show_scene(tiny.scene)
    window.bench.do("dock.live")
    live = window.bench.shared(LiveRun)
    pushes = []

    def state():
        session = live.session
        return None if session is None else str(session.status().state)

    def use(*, layout=LAYOUT, place=Place.SCAN):
        live.use(LiveSetup(parse_address(PUSHED), layout=layout, place=place, calibrates=False))

    def push():
        until(lambda: live.session is not None and live.session.status().listening_at)
        options = StreamOptions(fps=FPS, bitrate=2_000_000, keyframe_interval=5)
        url = live.session.status().listening_at
        stream = RtmpPush(url, textured(), WallClock(), options=options)
        pushes.append(stream)
        return stream

    def go_live():
        """To a session that is live, by the one button."""
        use()
        dock.head.next.click()
        stream = push()
        until(lambda: state() == "ready")
        until(lambda: dock.head.next.text() == "Go live")
        dock.head.next.click()
        until(lambda: state() == "live")
        return stream

    dock = window.content("live")
    yield SimpleNamespace(
        window=window,
        bench=window.bench,
        live=live,
        dock=dock,
        state=state,
        use=use,
        push=push,
        go_live=go_live,
        until=until,
    )
    for stream in pushes:
        stream.close()
    window.close()
    dispose(window)
