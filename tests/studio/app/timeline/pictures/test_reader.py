"""Any order of instants gives the pictures of the replay, whichever way they are decoded."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.messages import EncodedFrame
from devices.recording import Recorder, read_recording, read_session
from devices.recording_codec import FrameStamp
from devices.replay import ReplayCamera
from scenes.pose import Pose
from studio.app.timeline.pictures import decoding
from studio.app.timeline.pictures.reader import PictureReader
from studio.app.timeline.recorded.reading import read_index
from studio.bench.timeline import write_recording

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
