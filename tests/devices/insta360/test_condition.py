"""A simulated camera's battery, card and clock, asked over HTTP."""

import time
from dataclasses import replace

import pytest

from devices.clock import WallClock
from devices.insta360 import condition
from devices.insta360.condition import CameraCondition, ConditionWatch
from sim.wire.osc_camera import OscCamera
from sim.wire.osc_server import OscFaults, OscServer
from tests.devices.insta360.conftest import INFO

UNIX_S = 1_800_000_000.0


@pytest.fixture
def camera(monkeypatch):
    monkeypatch.setattr(condition, "PAUSE_S", 0.0)
    server = OscServer(OscCamera(WallClock(), INFO))
    yield server
    server.close()


@pytest.fixture
def watched(camera):
    """Watches the camera twenty times a second; `watched.said` is what it was told."""
    said = []
    watch = ConditionWatch(
        *camera.address, clock=WallClock(), unix_s=lambda: UNIX_S, say=said.append, every_s=0.05
    )
    watch.said = said
    yield watch
    watch.close()


def until(is_so, limit_s=120.0):
    deadline = time.monotonic() + limit_s
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_camera_says_what_it_is_and_how_it_is(watched):
    until(lambda: watched.last is not None)
    found = watched.last
    assert (found.model, found.serial, found.firmware) == ("Insta360 X4", "IXSE42", "v1.4.6")
    assert found.battery == pytest.approx(0.83)
    assert found.card == "pass"
    # The simulated camera's clock begins at 0 with the session.
    assert found.ahead_s == pytest.approx(-UNIX_S, abs=60)


def test_a_low_battery_is_said_once_a_step_and_again_after_it_was_charged(camera, watched):
    def set_battery(level):
        camera._camera.info = replace(INFO, battery=level)
        until(lambda: watched.last is not None and watched.last.battery == level)

    for level in (0.5, 0.19, 0.18, 0.09, 0.9, 0.15):
        set_battery(level)
    until(lambda: len(watched.said) == 3)
    assert [words.split(":")[0] for words in watched.said] == [
        "the camera's battery is at 19%",
        "the camera's battery is at 9%",
        "the camera's battery is at 15%",
    ]


def test_a_camera_that_answers_no_more_says_nothing(camera, watched):
    until(lambda: watched.last is not None)
    camera.faults = OscFaults(garbage=True)
    until(lambda: watched.last is None)
    camera.faults = OscFaults()
    until(lambda: watched.last is not None)
    assert watched.said == []


@pytest.mark.parametrize(
    ("battery", "card", "ahead_s", "text"),
    [
        (0.64, "pass", 0.2, "Insta360 X4 v1.4.6, battery 64%, card ready"),
        (None, "noCard", 61.0, "Insta360 X4 v1.4.6, card none, clock 61 s ahead"),
        (None, "", -3.0, "Insta360 X4 v1.4.6, clock 3 s behind"),
    ],
)
def test_it_is_told_in_a_line(battery, card, ahead_s, text):
    assert CameraCondition("Insta360 X4", "", "v1.4.6", battery, card, ahead_s).text == text
