"""A live session end to end: a real stream in, poses out, a recording that replays the same."""

from __future__ import annotations

import numpy as np
import pytest

from devices.recording import read_recording, read_session
from devices.recording_codec import FrameStamp
from studio.live.placing import PlacingError
from studio.live.status import LiveState
from studio.session.pipeline import recorded_messages
from tracking.options import TrackerOptions


def test_pictures_are_tracked_recorded_and_come_again_to_the_bit(live):
    seen = {}
    session = live.session()
    played = live.run(session, lambda o: seen.update({o.input.frame.seq: o.input.frame}))
    live.push(session)
    live.until(lambda: len(seen) >= 25)
    session.end()
    played.thread.join(120)
    result = played.result
    assert result.recording_failure == ""
    assert result.session.frames == len(seen)
    assert session.status().state is LiveState.ENDED
    path = live.folder / "live.mcap"
    again = {m.frame.seq: m.frame for m in recorded_messages(path, read_session(path))}
    assert sorted(again) == sorted(seen)
    for seq, frame in again.items():
        assert frame.t_ns == seen[seq].t_ns
        for image, before in zip(frame.images, seen[seq].images, strict=True):
            np.testing.assert_array_equal(image, before)
    stages = {stage.name for stage in result.latencies.stages()}
    assert stages - {"way"} == {"decode", "wait", "lens pictures", "track", "whole"}
    # One-way stamps over loopback: the clock's rate is known, and nothing was taken in the future.
    clock = session.status().camera_clock
    if clock is not None:
        assert clock.is_one_way


def test_pictures_that_the_tracker_missed_are_recorded_but_not_marked(live):
    session = live.session()
    waiter = __import__("threading").Event()
    played = live.run(session, lambda output: waiter.wait(0.2))
    live.push(session)
    live.until(lambda: session.status().frames >= 8)
    session.end()
    played.thread.join(120)
    values = list(read_recording(live.folder / "live.mcap"))
    stamps = [v for v in values if isinstance(v, FrameStamp)]
    packets = [v for v in values if type(v).__name__ == "EncodedFrame"]
    assert len(stamps) == played.result.session.frames
    assert len(packets) > 2 * len(stamps)
    assert played.result.session.dropped > len(stamps)


def test_a_camera_that_vanishes_and_returns_leaves_a_gap_in_the_recording(live):
    session = live.session()
    played = live.run(session)
    first = live.push(session)
    live.until(lambda: session.status().frames >= 10)
    first.close()
    live.until(lambda: session.status().camera.state == "held")
    assert session.status().camera.last_age_ns > 1e9
    before = session.status().frames
    live.push(session)
    live.until(lambda: session.status().frames >= before + 10)
    session.end()
    played.thread.join(120)
    assert played.error is None
    assert played.result.camera.connections == 2
    kinds = [event.kind for event in played.result.events]
    assert "camera-gap" in kinds
    path = live.folder / "live.mcap"
    assert any(getattr(v, "kind", "") == "camera-gap" for v in read_recording(path))
    again = [m.frame.seq for m in recorded_messages(path, read_session(path))]
    assert len(again) == played.result.session.frames


def test_a_person_goes_live_and_changes_and_undoes_a_setting(live):
    session = live.session(asks=True)
    played = live.run(session)
    live.push(session)
    live.until(lambda: session.status().state is LiveState.READY)
    assert session.status().live_s is None
    session.go_live()
    live.until(lambda: session.status().state is LiveState.LIVE)
    session.adjust_tracker(TrackerOptions(texture=False))
    assert session.options.texture is False
    assert session.undo_adjustment()
    assert session.options == TrackerOptions()
    assert not session.undo_adjustment()
    live.until(lambda: session.status().live_s > 0.3)
    session.end()
    played.thread.join(120)
    assert [change.text[:8] for change in played.result.changes] == ["tracker:", "tracker,"]
    assert played.result.live_s > 0.2


def test_a_doubtful_layout_is_confirmed_by_the_person(live):
    from tests.studio.live.conftest import LAYOUT

    session = live.session(layout=None, asks=True)
    played = live.run(session)
    live.push(session)
    states = {LiveState.CONFIRMING, LiveState.READY}
    live.until(lambda: session.status().state in states)
    # This texture is no room: nobody can say what is up in it.
    assert session.status().state is LiveState.CONFIRMING
    session.choose_layout(LAYOUT)
    live.until(lambda: session.status().state is LiveState.READY)
    assert session.layout == LAYOUT
    session.end()
    played.thread.join(120)


class Refused:
    world_from_rig = None
    refusal = "nobody knows this room"

    def described(self):
        return ""


def test_a_camera_that_is_not_found_is_an_error_or_a_question(live):
    from studio.live.setup import Place

    alone = live.session(place=Place.FIND, locate=lambda frame, near: Refused())
    played = live.run(alone)
    live.push(alone)
    played.thread.join(120)
    assert isinstance(played.error, PlacingError)
    assert "nobody knows this room" in str(played.error)

    asked = live.session(place=Place.FIND, asks=True, locate=lambda frame, near: Refused())
    played = live.run(asked)
    live.push(asked)
    live.until(lambda: asked.status().state is LiveState.REFUSED)
    assert "nobody knows this room" in asked.status().text
    asked.end()
    played.thread.join(120)
    assert played.error is None
    assert played.result.session is None


def test_a_full_disk_ends_the_recording_and_not_the_session(live, monkeypatch):
    import errno

    from devices.recording import Recorder

    session = live.session()
    written = []
    original = Recorder.write

    def write(self, value):
        written.append(value)
        if len(written) > 40:
            raise OSError(errno.ENOSPC, "recording stopped: the disk is full")
        original(self, value)

    monkeypatch.setattr(Recorder, "write", write)
    played = live.run(session)
    live.push(session)
    live.until(lambda: session.status().recording_failure)
    frames = session.status().frames
    live.until(lambda: session.status().frames > frames + 10)
    session.end()
    played.thread.join(120)
    assert played.error is None
    assert "the disk is full" in played.result.recording_failure
    assert (live.folder / "live.mcap.part").exists()
    assert played.result.camera.unsaved > 0


def test_a_session_that_ends_before_its_camera_comes_ends_at_once(live):
    session = live.session()
    played = live.run(session)
    live.until(lambda: session.status().listening_at)
    session.end()
    played.thread.join(120)
    assert played.result.session is None
    with pytest.raises(ValueError, match="wait until"):
        session.make_live(None)
