"""States and banners in words: what is most important comes first."""

from __future__ import annotations

import pytest

from devices.camera.received import CameraState, CameraStatus
from devices.messages import Event
from studio.app.live.words import (
    MOVED_SHOWN_S,
    Help,
    age_words,
    banner_of,
    begun_with_a_capital,
    elapsed_words,
    light_of,
    size_words,
)
from studio.app.shell.theme import SHAPES
from studio.live.status import LiveState, LiveStatus
from studio.session.trackers.camera_events import camera_events
from tracking.output import CameraMoment, CameraNotice

S = 1_000_000_000


def status(
    state=LiveState.LIVE,
    camera=CameraState.LIVE,
    *,
    reason="all is well",
    failure="",
    is_lost=False,
):
    return LiveStatus(
        state,
        "live",
        CameraStatus(camera, reason),
        recording_failure=failure,
        is_camera_lost=is_lost,
    )


def event(kind, t_s, source="session", text="the camera did something"):
    return Event(round(t_s * S), source, kind, text)


def moment(of, t_s):
    return camera_events(round(t_s * S), (CameraNotice(of, 0.6, 0.5, 2.0),))[0]


@pytest.mark.parametrize("state", list(LiveState))
def test_every_state_has_a_shape_and_a_word_of_its_own(state):
    light = light_of(status(state))
    assert light.kind in SHAPES
    assert light.word
    others = {light_of(status(other)).word for other in LiveState if other is not state}
    assert light.word not in others


def test_a_camera_that_stops_comes_before_the_state():
    assert light_of(status(camera=CameraState.HELD)).word == "held"
    assert light_of(status(camera=CameraState.FAILED)).word == "failed"
    assert light_of(status(LiveState.CONNECTING, CameraState.HELD)).word == "connecting"
    assert light_of(status(LiveState.ENDED, CameraState.FAILED)).word == "ended"


def test_the_most_important_banner_is_shown():
    lost = (event("camera-refused", 1),)
    failed = banner_of(status(camera=CameraState.FAILED, failure="disk"), lost, now_ns=2 * S)
    assert failed is not None
    assert failed.text.startswith("No camera: all is well")
    full = banner_of(status(failure="the disk is full"), lost, now_ns=2 * S)
    assert full is not None
    assert "the disk is full" in full.text
    held = banner_of(status(camera=CameraState.HELD), lost, now_ns=2 * S)
    assert held is not None
    assert held.help is Help.NONE
    found = banner_of(status(is_lost=True), lost, now_ns=2 * S)
    assert found is not None
    assert (found.kind, found.help) == ("bad", Help.FIND)
    assert banner_of(status(LiveState.ENDED, failure="disk"), lost, now_ns=2 * S) is None
    assert banner_of(status(LiveState.PLACING), lost, now_ns=2 * S) is None


def test_a_bump_is_shown_for_a_while():
    # What the tracker says in the frame of a bump that its pictures explain.
    bump = (moment(CameraMoment.BUMPED, 10), moment(CameraMoment.FOUND, 10))
    soon = banner_of(status(), bump, now_ns=11 * S)
    assert soon is not None
    assert soon.kind == "warning"
    assert "0.60° and 0.5 cm" in soon.text
    late_ns = round((10.1 + MOVED_SHOWN_S) * S)
    assert banner_of(status(), bump, now_ns=late_ns) is None
    placed = (*bump, event("camera-placed", 12))
    assert banner_of(status(), placed, now_ns=13 * S) is None
    assert banner_of(status(), (event("changed", 1),), now_ns=S) is None


def test_a_lost_camera_is_shown_until_it_is_found():
    lost = (moment(CameraMoment.BUMPED, 9), moment(CameraMoment.NOT_FOUND, 10))
    shown = banner_of(status(is_lost=True), lost, now_ns=1000 * S)
    assert shown is not None
    assert (shown.kind, shown.help) == ("bad", Help.FIND)
    assert "free its view" in shown.text
    assert light_of(status(is_lost=True)).word == "camera lost"
    assert banner_of(status(), lost, now_ns=1000 * S) is None


def test_numbers_as_people_read_them():
    assert age_words(None) == "–"
    assert age_words(round(12.34 * S)) == "12.3 s ago"
    assert elapsed_words(3725.9) == "1:02:05"
    assert size_words(12_345_678) == "12.3 MB"
    assert begun_with_a_capital("objects: 3 tracked") == "Objects: 3 tracked"
    assert begun_with_a_capital("rtsp://x: refused") == "rtsp://x: refused"
