"""Frames of the pipe: there and back, cut, and of another program."""

import io

import pytest

from devices.hub.media import frames
from devices.hub.media.voice_wire import Voice

VOICE = Voice(3, 960, 20, b"\x78abc")


def test_frames_go_there_and_back():
    data = frames.pack_order({"do": "close", "person": 1})
    data += frames.pack_voice(7, VOICE) + frames.pack_picture("p1/tür", b"jpeg")
    (order, voice, picture) = frames.read_frames(io.BytesIO(data))
    assert frames.read_order(order[1]) == {"do": "close", "person": 1}
    assert frames.read_voice(voice[1]) == (7, VOICE)
    assert frames.read_picture(picture[1]) == ("p1/tür", b"jpeg")
    assert [kind for kind, _data in (order, voice, picture)] == [1, 2, 3]


def test_a_frame_that_is_cut_ends_them_and_another_program_is_noticed():
    data = frames.pack_voice(7, VOICE)
    for end in range(len(data)):
        assert list(frames.read_frames(io.BytesIO(data[:end]))) == []
    with pytest.raises(ValueError, match="kind 87"):
        list(frames.read_frames(io.BytesIO(b"Warning: something")))
    with pytest.raises(ValueError, match="at most"):
        frames.pack_picture("a", bytes(frames.MAX_FRAME_BYTES))
