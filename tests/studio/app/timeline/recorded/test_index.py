import threading
from dataclasses import replace

import numpy as np
import pytest

from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedSurface,
)
from devices.recording import Recorder, RecordingError, read_recording, read_session
from devices.recording_codec import FrameStamp, RecordedTrack, encode_message
from devices.replay import ReplayCamera
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, AvatarGone, LiveSurface, SceneState, reduce_state
from studio.app.timeline.pictures.reader import PictureReader
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.recorded.reading import read_index
from studio.session.pipeline import time_ns_of

NOTHING = np.zeros((0, 3))


def reduced(path, t_ns):
    """The state after every message up to a time, and the camera's pose as it was known."""
    state, rig = SceneState(), None
    for value in read_recording(path):
        if time_ns_of(value) > t_ns:
            break
        if isinstance(value, RecordedTrack) and value.method == "own":
            state = reduce_state(state, value.track, value.track.t_ns)
        elif isinstance(value, RecordedAvatar):
            state = reduce_state(state, value.avatar, value.t_ns)
        elif isinstance(value, RecordedAvatarGone):
            state = reduce_state(state, value.gone, value.t_ns)
        elif isinstance(value, RecordedSurface):
            state = reduce_state(state, value.surface, value.t_ns)
        elif isinstance(value, RecordedAnnotation):
            state = reduce_state(state, value.annotation, value.t_ns)
        elif isinstance(value, FrameStamp) and value.world_from_rig is not None:
            rig = value.world_from_rig
    return state, rig


def plain(state):
    """Every number of a state, as a recording would write it."""
    messages = [
        *(RecordedTrack("own", item) for item in state.objects.values()),
        *(RecordedAvatar(0, item) for item in state.avatars.values()),
        *(RecordedSurface(0, item) for item in state.surfaces.values()),
        *(RecordedAnnotation(0, item) for item in state.annotations.values()),
    ]
    return state.version, state.t_ns, [encode_message(message) for message in messages]


@pytest.fixture(scope="module")
def busy(recording, tmp_path_factory):
    """The recording with people's hands, a growing line and a surface beside it."""
    path = tmp_path_factory.mktemp("busy") / "recording.mcap"
    rng = np.random.default_rng(3)
    hands = tuple(rng.normal(size=(count, 3)) for count in (21, 5))
    corners = rng.normal(size=(4, 3))
    with Recorder(path, read_session(recording)) as recorder:
        for value in read_recording(recording):
            recorder.write(value)
        for number in range(5):
            t_ns = 150_000_000 * number
            head = Pose.from_yaw(0.1 * number, (number, 0, 1.6))
            ray = rng.normal(size=(2, 3)) if number % 2 else None
            recorder.write(RecordedAvatar(t_ns, Avatar("ana", "local", head, hands, ray)))
            points = rng.normal(size=(number, 3))
            line = Annotation("line-1", "ana", points, (1.0, 0.5, 0.0))
            recorder.write(RecordedAnnotation(t_ns, line))
        surface = LiveSurface("board", corners, (64, 48), "camera-360")
        recorder.write(RecordedSurface(400_000_000, surface))
        recorder.write(RecordedAvatarGone(420_000_000, AvatarGone("nobody")))
        recorder.write(RecordedAvatarGone(640_000_000, AvatarGone("ana")))
        recorder.write(RecordedAnnotation(645_000_000, replace(line, points_in_world=NOTHING)))
        recorder.write(RecordedSurface(645_000_000, replace(surface, corners_in_world=NOTHING)))
    return path


@pytest.mark.parametrize("t_ms", [-1, 0, 50, 150, 299, 300, 301, 401, 650, 1100, 9000])
def test_a_state_is_that_of_all_messages_until_then(busy, t_ms):
    index = read_index(busy)
    state, rig = reduced(busy, t_ms * 10**6)
    shown = index.state_at(t_ms * 10**6)
    assert plain(shown) == plain(state)
    assert (shown.world_from_rig is None) == (rig is None)
    if rig is not None:
        assert np.array_equal(shown.world_from_rig.matrix(), rig.matrix())


def test_a_picture_is_that_of_the_replay(recording, index):
    frames = list(ReplayCamera(recording).frames())
    reader = PictureReader(recording, index.packets)
    for number in (7, 2, 3, 11, 11, 0):
        shown = reader.picture_at(frames[number].t_ns + 1)
        assert shown.t_ns == frames[number].t_ns
        assert np.array_equal(shown.picture, frames[number].images[0])
    reader.close()


def test_there_is_no_picture_before_the_first(recording, index):
    reader = PictureReader(recording, index.packets)
    assert reader.picture_at(-1) is None
    reader.close()


def test_what_is_stale_is_not_decoded_and_what_follows_is_right(recording, index):
    frames = list(ReplayCamera(recording).frames())
    reader = PictureReader(recording, index.packets)
    assert reader.picture_at(frames[9].t_ns, is_stale=lambda: True) is None
    shown = reader.picture_at(frames[9].t_ns)
    assert np.array_equal(shown.picture, frames[9].images[0])
    reader.close()


def test_the_keyframe_comes_early_where_the_picture_takes_long(recording, index):
    frames = list(ReplayCamera(recording).frames())
    reader, early = PictureReader(recording, index.packets), []
    shown = reader.picture_at(frames[9].t_ns, early=early.append)
    assert [picture.t_ns for picture in early] == [frames[0].t_ns]
    assert np.array_equal(early[0].picture, frames[0].images[0])
    assert np.array_equal(shown.picture, frames[9].images[0])
    reader.picture_at(frames[1].t_ns, early=early.append)
    assert len(early) == 1
    reader.close()


def test_the_thread_gives_what_was_asked_for_last(index):
    thread = PictureThread(index)
    last_ns = int(index.frames_ns[-1])
    for t_ns in index.frames_ns:
        thread.ask(int(t_ns))
    shown = thread.pictures.take(timeout_s=20)
    while shown is not None and shown.t_ns != last_ns:
        shown = thread.pictures.take(timeout_s=20)
    assert shown is not None
    thread.stop()


def test_it_reports_progress_and_can_be_cancelled(recording):
    shares = []
    read_index(recording, progress=shares.append)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    cancelled = threading.Event()
    cancelled.set()
    assert read_index(recording, cancelled=cancelled) is None


def test_a_recording_that_is_too_long_is_cut_and_says_so(recording):
    index = read_index(recording, most_numbers=300)
    assert "too long" in index.shortened
    assert 0 < len(index.frames_ns) < 12


def test_an_empty_recording_is_empty(recording, tmp_path):
    path = tmp_path / "empty.mcap"
    with Recorder(path, read_session(recording)):
        pass
    index = read_index(path)
    assert index.is_empty
    assert not index.state_at(0).objects


def test_a_recording_that_was_cut_off_is_shown_as_far_as_it_goes(recording, tmp_path):
    data = recording.read_bytes()
    path = tmp_path / "cut.mcap.part"
    path.write_bytes(data[:-100])
    whole, cut = read_index(recording), read_index(path)
    assert whole is not None
    assert cut is not None
    assert (cut.start_ns, cut.end_ns) == (whole.start_ns, whole.end_ns)


def test_a_damaged_recording_is_refused(recording, tmp_path):
    path = tmp_path / "damaged.mcap"
    path.write_bytes(recording.read_bytes()[:40])
    with pytest.raises(RecordingError, match="ends early after 40 bytes"):
        read_index(path)
