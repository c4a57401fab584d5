"""A live recording is whole if all went well; a full disk ends it without ending the session."""

from __future__ import annotations

import errno

import pytest

from devices.messages import Event
from devices.recording import Recorder, read_recording
from devices.streams import StreamClosedError
from studio.session.plan import SessionPlan
from studio.session.records.live_recording import LiveRecording


def event(k: int) -> Event:
    return Event(k, "test", "count", str(k))


def test_what_was_written_and_offered_is_there(tiny, tmp_path):
    path = tmp_path / "live.mcap"
    with LiveRecording(path, tiny.session(SessionPlan()).info) as recording:
        for k in range(20):
            (recording.write if k % 2 else recording.offer)(event(k))
    assert recording.failure == ""
    assert [value.t_ns for value in read_recording(path)] == list(range(20))


def test_a_full_disk_stops_the_recording_and_says_so(tiny, tmp_path, monkeypatch):
    written = []

    def write(self, value):
        if len(written) == 5:
            raise OSError(errno.ENOSPC, "recording stopped: the disk is full")
        written.append(value)

    monkeypatch.setattr(Recorder, "write", write)
    path = tmp_path / "live.mcap"
    with LiveRecording(path, tiny.session(SessionPlan()).info) as recording:
        for k in range(50):
            recording.write(event(k))
    assert "the disk is full" in recording.failure
    assert len(written) == 5
    assert not path.exists()
    assert path.with_name("live.mcap.part").exists()
    with pytest.raises(StreamClosedError, match="full"):
        recording.offer(event(99))
