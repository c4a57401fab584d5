"""Any order of instants gives the pictures of the replay, whichever way they are decoded."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.studio.seeking import write_recording
from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.messages import EncodedFrame
from devices.recording import Recorder, read_recording, read_session
from devices.recording_codec import FrameStamp
from devices.replay import ReplayCamera
from devices.session_info import LiveStream, SessionInfo
from devices.video import H264Encoder
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from studio.app.timeline.pictures import decoding
from studio.app.timeline.pictures.reader import PictureReader
from studio.app.timeline.recorded.reading import read_index

FRAMES = 50
"""Three groups of pictures at ten a second."""


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "recording.mcap"
    write_recording(path, duration_s=FRAMES / 10, lens_px=32)
    return read_index(path)


@pytest.fixture(scope="module")
def pictures(long):
    return [frame.images for frame in ReplayCamera(long.path).frames()]


@given(st.lists(st.integers(0, FRAMES - 1), min_size=1, max_size=12), st.sampled_from([1, 4]))
@settings(max_examples=25)
def test_pictures_in_any_order_are_those_of_the_replay(long, pictures, numbers, threads):
    reader = PictureReader(long.path, long.packets, threads=threads)
    for number in numbers:
        t_ns = int(long.packets.t_ns[number])
        shown = reader.picture_at(t_ns)
        assert shown.t_ns == t_ns
        assert shown.is_exact
        assert shown.is_full
        assert all(
            np.array_equal(a, b) for a, b in zip(shown.lenses, pictures[number], strict=True)
        )
    reader.close()


def test_playing_on_takes_a_packet_a_picture(long):
    reader = PictureReader(long.path, long.packets, threads=4)
    reader.picture_at(int(long.packets.t_ns[13]))
    lefts = []
    for number in range(14, FRAMES):
        lefts.append(reader.left(int(long.packets.t_ns[number])))
        assert reader.picture_at(int(long.packets.t_ns[number])).t_ns == long.packets.t_ns[number]
        assert reader.is_soon(int(long.packets.t_ns[number]))
    assert set(lefts) == {1}
    # A keyframe is one packet, but another decoder's.
    assert reader.left(0) == 1
    assert not reader.is_soon(0)
    assert reader.left(int(long.packets.t_ns[FRAMES - 1])) == 0
    reader.close()


def test_a_damaged_group_is_decoded_one_by_one_and_the_next_in_a_run_again(
    long, tmp_path, monkeypatch
):
    path = tmp_path / "damaged.mcap"
    with Recorder(path, read_session(long.path)) as recorder:
        for value in read_recording(long.path):
            if isinstance(value, EncodedFrame) and value.seq == 4:
                value = replace(value, data=value.data[:40])
            recorder.write(value)
    index = read_index(path)
    alone = []
    decoded = decoding.OneByOne.decoded

    def counted(self, first, last, **rest):
        alone.append(last)
        return decoded(self, first, last, **rest)

    monkeypatch.setattr(decoding.OneByOne, "decoded", counted)
    truth = {frame.t_ns: frame.images[0] for frame in ReplayCamera(path).frames()}
    reader = PictureReader(path, index.packets, threads=4)
    for number in (2, 8, 9, 25, 31, 12):
        shown = reader.picture_at(int(index.packets.t_ns[number]))
        if shown is not None:
            assert np.array_equal(shown.picture, truth[shown.t_ns])
    assert {8, 9, 12} <= set(alone)
    assert not {25, 31} & set(alone)
    reader.close()


def test_another_connection_begins_another_decoder(long, pictures, tmp_path):
    path = tmp_path / "again.mcap"
    with Recorder(path, read_session(long.path)) as recorder:
        for value in read_recording(long.path):
            if isinstance(value, EncodedFrame):
                recorder.write(FrameStamp("camera-360", value.seq, value.t_ns, 0, Pose.identity()))
                recorder.write(replace(value, begins=value.seq in (0, 20)))
    index = read_index(path)
    reader = PictureReader(path, index.packets, threads=4)
    for number in (17, 19, 20, 22, 41):
        shown = reader.picture_at(int(index.packets.t_ns[number]))
        assert np.array_equal(shown.picture, pictures[number][0])
    reader.close()


@pytest.fixture(scope="module")
def two_tracks(tmp_path_factory):
    """A camera that sends a track a lens: the second two milliseconds after the first.

    Their keyframes do not coincide.
    """
    path = tmp_path_factory.mktemp("tracks") / "recording.mcap"
    lens = Fisheye.from_fov(64, np.radians(200))
    rig = Rig((lens, lens), (Pose.identity(), FRONT_FROM_BACK_LENS))
    stream = LiveStream(LensLayout(Arrangement.ONE_LENS, (0,)), 64, tracks=2)
    info = SessionInfo("none", "0", None, "", "", "live", ("own",), {}, rig, 10.0, stream=stream)
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    encoders = [H264Encoder(64, 64, 10.0, 2_000_000, keyframe_interval=n) for n in (7, 5)]
    with Recorder(path, info) as recorder:
        for number in range(20):
            t_ns = 10**8 * (number + 1)
            for track, encoder in enumerate(encoders):
                turned = np.roll(noise, (2 * number, 30 * track), axis=(1, 0))
                (packet,) = encoder.encode(turned, 2 * number + track, t_ns + 2_000_000 * track)
                name = f"camera-360/{track}" if track else "camera-360"
                recorder.write(replace(packet, stream_id=name, begins=number == 0))
            seq, arrived_ns = 2 * number + 1, t_ns + 2_000_000
            recorder.write(FrameStamp("camera-360", seq, arrived_ns, arrived_ns, Pose.identity()))
    return read_index(path)


@given(st.lists(st.integers(1, 20), min_size=1, max_size=12))
@settings(max_examples=25)
def test_a_track_a_lens_gives_the_pictures_of_the_replay(two_tracks, numbers):
    assert two_tracks.packets.topics == ("/camera-360/video", "/camera-360/1/video")
    replayed = {f.t_ns: f.images for f in ReplayCamera(two_tracks.path).frames()}
    assert len(replayed) == 20
    reader = PictureReader(two_tracks.path, two_tracks.packets)
    for number in numbers:
        # The second track of the picture after it has not come yet.
        t_ns = 10**8 * (number + 1) + 1_000_000
        shown = reader.picture_at(t_ns)
        assert shown.t_ns == 10**8 * number + 2_000_000
        assert len(shown.lenses) == 2
        for lens, truth in zip(shown.lenses, replayed[shown.t_ns], strict=True):
            assert np.array_equal(lens, truth)
    assert reader.picture_at(10**8) is None
    reader.close()
