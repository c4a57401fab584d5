"""What is looked at before going live: a camera that streams, none, and one in the dark."""

from __future__ import annotations

import numpy as np

from studio.live.checks import live_checks
from studio.session.preflight import run_checks, worst
from tests.pushed_camera import FedPicture
from tests.studio.live.conftest import FPS


def checked(live, session):
    checks = run_checks(live_checks(session, recordings=live.folder))
    return {check.name: check for check in checks}, checks


def test_a_streaming_camera_passes(live):
    session = live.session(record=False)
    live.push(session)
    live.until(lambda: session.status().camera.pictures > 3)
    found, checks = checked(live, session)
    assert [found[name].verdict for name in ("camera", "stream", "light")] == ["PASS"] * 3
    assert "256×128" in found["camera"].what
    assert worst(checks) in ("PASS", "WARN")  # the machine's own lines are not this test's
    assert {"clock", "tracker", "disk space", "recordings"} <= found.keys()


def test_without_a_camera_the_address_to_enter_is_the_fix(live):
    session = live.session(record=False)
    live.until(lambda: session.status().listening_at)
    found, _ = checked(live, session)
    assert found["camera"].verdict == "WARN"
    assert session.status().listening_at in found["camera"].fix
    assert found["stream"].verdict == found["light"].verdict == "WARN"


def test_a_camera_that_cannot_be_opened_fails_with_a_fix(live, tmp_path):
    from devices.camera.address import parse_address
    from studio.live.live import LiveSession
    from studio.live.setup import LiveSetup

    setup = LiveSetup(parse_address(str(tmp_path / "gone.mp4")))
    session = LiveSession("tiny", None, setup, clock=live.clock, renderer=None, locate=None)
    live.until(lambda: session.status().camera.state == "failed")
    found, _ = checked(live, session)
    assert found["camera"].verdict == "FAIL"
    assert "gone.mp4" in found["camera"].what
    assert found["camera"].fix


def test_darkness_and_glare_are_said(live):
    def of_level(level):
        for number in range(200):
            yield FedPicture(round(number * 1e9 / FPS), np.full((128, 256, 3), level, np.uint8))

    for level, verdict in ((25, "WARN"), (254, "WARN"), (0, "FAIL")):
        session = live.session(record=False)
        stream = live.push(session, of_level(level))
        live.until(lambda session=session: session.status().camera.pictures > 2)
        found, _ = checked(live, session)
        assert found["light"].verdict == verdict, level
        assert found["light"].fix
        stream.close()


def test_an_insta360_says_its_battery_before_and_while_it_is_live(live, monkeypatch):
    from devices.camera.address import parse_address
    from devices.insta360 import condition
    from devices.insta360.commands import CameraInfo
    from sim.wire.osc_camera import OscCamera
    from sim.wire.osc_server import OscServer
    from studio.live.live import LiveSession
    from studio.live.setup import LiveSetup

    monkeypatch.setattr(condition, "PAUSE_S", 0.0)
    camera = OscCamera(live.clock, CameraInfo("SIM1", "Insta360 X4", "v1.4.6", 0.18))
    server = OscServer(camera)
    # Nothing sends pictures there: what it says of itself does not need any.
    address = parse_address(f"insta360://127.0.0.1:9?http={server.address[1]}")
    session = LiveSession(
        "tiny", None, LiveSetup(address), clock=live.clock, renderer=None, locate=None
    )
    try:
        live.until(lambda: session.status().condition)
        found, _ = checked(live, session)
        assert found["battery"].verdict == "WARN"
        assert "battery 18%" in found["battery"].what
        assert "plug" in found["battery"].fix
    finally:
        session.end()
        session.run(lambda output: None)
        server.close()
    assert session.status().condition is not None
