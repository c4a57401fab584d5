"""Packets go nowhere before a recording begins, and begin at a keyframe."""

from __future__ import annotations

import pytest

from devices.messages import EncodedFrame
from devices.streams import StreamFullError
from studio.live.camera_frames import PacketTap, PictureTimes


def packet(seq, *, keyframe=False):
    return EncodedFrame("camera-360", seq, seq, b"", keyframe)


def test_a_recording_begins_at_a_keyframe():
    tap, written = PacketTap(), []
    tap.put(packet(0, keyframe=True))
    assert tap.first_seq is None
    tap.open(written.append)
    tap.put(packet(1))
    assert tap.first_seq is None
    tap.put(packet(2, keyframe=True))
    tap.put(packet(3))
    assert tap.first_seq == 2
    tap.close()
    tap.put(packet(4))
    assert [p.seq for p in written] == [2, 3]


def test_a_disk_that_is_too_slow_is_the_receiver_s_to_count():
    def full(value):
        raise StreamFullError("full")

    tap = PacketTap()
    tap.open(full)
    with pytest.raises(StreamFullError):
        tap.put(packet(0, keyframe=True))


def test_stages_follow_one_another():
    times = PictureTimes(None, None, 100, 130, 170, 175)
    assert times.stages() == {"decode": 30, "wait": 40, "lens pictures": 5}
    times = PictureTimes(7, 90, 100, 130, 170, 175)
    assert times.stages() == {"way": 10, "decode": 30, "wait": 40, "lens pictures": 5}
