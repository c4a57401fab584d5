import threading

import numpy as np
import pytest

from devices.messages import Event
from devices.recorded.people import RecordedAnnotation, RecordedSurface
from devices.recording import Recorder, RecordingError, read_session
from devices.recording_codec import RecordedTrack
from scenes.pose import Pose
from scenes.state import Annotation, LiveSurface, TrackedObject, TrackState
from studio.handover.moments import MAX_EVENTS, read_moments
from studio.session.pipeline import CancelledError


def read(path, method="own", cancelled=None):
    return read_moments(path, method, cancelled=cancelled or threading.Event())


def test_a_recording_becomes_what_a_viewer_shows(rehearsed, tiny):
    moments = read(rehearsed / "recording.mcap")

    chair, stool = moments.objects["chair-1"], moments.objects["stool-1"]
    assert moments.frames == tiny.frames
    assert moments.end_ms == 1100
    assert moments.moved == {"chair-1"}
    assert moments.events == [(300, "pushes chair 1")]
    # The stool never moved: two keys at most. The chair moved from frame 3 on, 5 cm a frame.
    assert len(stool.poses.t_ms) == 1
    assert chair.poses.t_ms[1:] == [200, *range(300, 1101, 100)]
    steps = [after[0] - before[0] for before, after in zip(*pairs(chair.poses.values), strict=True)]
    assert np.allclose(steps[1:], 0.05, atol=1e-6)
    assert chair.states == [(0, "tracked"), (600, "occluded"), (900, "tracked")]
    assert moments.people["maya"].role == "remote"
    assert moments.people["maya"].rays.values == [None]


def pairs(values):
    return values[:-1], values[1:]


def test_another_method_s_tracks_are_not_mixed_in(rehearsed):
    assert read(rehearsed / "recording.mcap", "paper").objects == {}


@pytest.fixture
def drawn(rehearsed, tmp_path):
    """A recording of a line that grows for two seconds, a surface, and far too many events."""
    path = tmp_path / "drawn.mcap"
    with Recorder(path, read_session(rehearsed / "recording.mcap")) as recorder:
        for step in range(100):
            t_ns = step * 20_000_000
            points = np.linspace((0, 0, 1), (step, 0, 1), step + 2)
            line = Annotation("line-1", "maya", points, (1.0, 0.5, 0.0))
            recorder.write(RecordedAnnotation(t_ns, line))
            for number in range(10):
                recorder.write(Event(t_ns, "ana", "say", f"{step}.{number}"))
            recorder.write(Event(t_ns, "camera", "dropped", f"frame {step}"))
            track = TrackedObject(
                "chair-1", t_ns, Pose.identity(), np.eye(4), 1.0, TrackState.LOST, 0.1, step
            )
            recorder.write(RecordedTrack("own", track))
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
        recorder.write(RecordedSurface(0, LiveSurface("desk", corners, (64, 64), "camera-360")))
    return path


def test_a_growing_line_is_kept_in_few_versions_and_whole_in_the_end(drawn):
    versions = read(drawn).lines["line-1"].versions

    assert len(versions) == 10
    assert np.diff([t_ms for t_ms, _points in versions]).min() >= 200
    assert len(versions[-1][1]) == 101


def test_a_surface_is_its_outline_closed(drawn):
    ((t_ms, points),) = read(drawn).lines["desk"].versions

    assert t_ms == 0
    assert len(points) == 5
    assert np.array_equal(points[0], points[-1])


def test_events_are_as_many_as_one_can_look_through_and_no_lost_frames(drawn):
    events = read(drawn).events

    assert len(events) == MAX_EVENTS
    assert not any(text.startswith("frame") for _t_ms, text in events)


def test_a_truncated_recording_gives_its_whole_moments_and_an_empty_one_is_refused(
    rehearsed, tmp_path
):
    short = tmp_path / "short.mcap"
    data = (rehearsed / "recording.mcap").read_bytes()
    short.write_bytes(data[:-100])
    assert read(short) == read(rehearsed / "recording.mcap")

    short.write_bytes(data[:40])
    with pytest.raises(RecordingError, match=r"short\.mcap: ends early"):
        read(short)


def test_a_cancelled_one_stops(rehearsed):
    cancelled = threading.Event()
    cancelled.set()

    with pytest.raises(CancelledError):
        read(rehearsed / "recording.mcap", cancelled=cancelled)
