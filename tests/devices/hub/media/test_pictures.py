"""A surface as VP8: sharp, small where nothing changes, whole when somebody asks."""

import av
import cv2
import numpy as np
import pytest

pytest.importorskip("aiortc")

from devices.hub.media.pictures import MAX_SIDE_PX, WHOLE_AFTER_NS, SurfaceVideo


def jpeg(number=0, size=(384, 256)):
    picture = np.full((size[1], size[0], 3), 230, np.uint8)
    cv2.putText(picture, f"slide {number}", (20, 140), 0, 2, (30, 30, 160), 4)
    return cv2.imencode(".jpg", picture)[1].tobytes()


def shown(packets):
    codec = av.CodecContext.create("libvpx", "r")
    frames = [frame for data in packets for frame in codec.decode(av.Packet(data))]
    return frames[-1].to_ndarray(format="bgr24")


def test_a_picture_is_seen_as_it_was_and_the_next_is_small():
    video = SurfaceVideo()
    first, pts, is_whole = video.encode(jpeg(1), 10**9)
    second, later, is_second_whole = video.encode(jpeg(1), 11 * 10**8)
    assert (is_whole, is_second_whole, later - pts) == (True, False, 9000)
    assert len(second) < len(first) / 5
    wanted = cv2.imdecode(np.frombuffer(jpeg(1), np.uint8), 1).astype(int)
    assert np.abs(shown([first, second]).astype(int) - wanted).mean() < 6


def test_a_whole_picture_is_made_when_it_is_wanted_but_not_too_often():
    video = SurfaceVideo()
    video.encode(jpeg(), 0)
    video.want_whole()
    assert not video.encode(jpeg(), WHOLE_AFTER_NS - 1)[2]
    assert video.encode(jpeg(), WHOLE_AFTER_NS + 1)[2]
    assert not video.encode(jpeg(), WHOLE_AFTER_NS + 2)[2]


def test_another_size_begins_anew_and_large_ones_are_made_smaller():
    video = SurfaceVideo()
    video.encode(jpeg(), 0)
    data, _pts, is_whole = video.encode(jpeg(size=(2001, 501)), 10**8)
    assert is_whole
    assert shown([data]).shape[1] == MAX_SIDE_PX
    with pytest.raises(ValueError, match="no JPEG"):
        video.encode(b"no picture", 2 * 10**8)
