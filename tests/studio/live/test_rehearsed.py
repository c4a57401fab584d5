"""A whole session on a small simulated camera in its own process; and cameras that fail."""

from __future__ import annotations

import threading
import time

import pytest

from devices.camera.address import parse_address
from devices.clock import WallClock
from scenes.opening import open_scene
from scenes.render.native import NativeRenderer
from studio.live.live import LiveSession
from studio.live.rehearsed import RehearsedLive, SimulatedCamera, SimulatedFeed
from studio.live.report import live_rows
from studio.live.setup import LiveSetup, Place

SMALL = SimulatedFeed("lab", "lab-short", film_s=2.0, size="720x360", fps=10.0)


def a_session(record_to=None):
    scene, renderer = open_scene("lab"), NativeRenderer()
    setup = LiveSetup(
        parse_address("rtmp://127.0.0.1:0/live/room"), place=Place.SCAN, calibrates=False
    )
    return LiveSession(
        "lab",
        scene,
        setup,
        clock=WallClock(),
        renderer=renderer,
        locate=None,
        record_to=record_to,
    )


def test_a_session_is_held_against_the_camera_s_truth(tmp_path):
    session = a_session(tmp_path / "live.mcap")
    said = []
    with RehearsedLive(session, SMALL, truth=tmp_path / "truth.jsonl", seconds=5.0) as rehearsed:
        rehearsed.wait_for_stream(said.append)
        over = threading.Event()

        def end():
            deadline = time.monotonic() + 240
            while time.monotonic() < deadline and not over.wait(0.1):
                live_s = session.status().live_s
                if live_s is not None and live_s > 6.0:
                    break
            session.end()

        threading.Thread(target=end, daemon=True).start()
        rehearsed.direct()
        result = session.run(rehearsed.watch)
        over.set()
        rows = {row.name: row for row in live_rows(result) + rehearsed.rows(result)}
    assert rows["live.frames"].value > 5
    # The camera's truth is on the same clock: nothing is known before it was shown.
    assert 0 < rows["live.frame_to_pose_ms.p50"].value < 30_000
    assert rows["live.object_cm.p50"].value < 10.0
    assert (tmp_path / "live.mcap").exists()


def test_a_camera_that_cannot_start_says_why(tmp_path):
    feed = SimulatedFeed("no-such-room")
    with SimulatedCamera(
        feed, push_to="rtmp://127.0.0.1:9/live/x", truth=tmp_path / "truth.jsonl"
    ) as camera:
        deadline = time.monotonic() + 120
        while not camera.failure and time.monotonic() < deadline:
            time.sleep(0.05)
        assert "no-such-room" in camera.failure
        camera.fault("black_hole:for=1")  # is of no use, and does no harm

    session = a_session()
    with (
        RehearsedLive(session, feed, truth=tmp_path / "t", seconds=None) as rehearsed,
        pytest.raises(ValueError, match="no-such-room"),
    ):
        rehearsed.wait_for_stream(lambda text: None)
    session.end()
    assert session.run(lambda output: None).session is None
