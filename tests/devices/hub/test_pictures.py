"""Pictures of live surfaces: the newest of each, after everything else, in turn."""

import pytest

from devices.hub.channels import BodyChannel, PictureChannel, StateChannel
from devices.hub.outbox import Outbox, Sent
from devices.hub.wire import MAX_PICTURE_BYTES, WireError, pack_picture


def taken(outbox, pictures, count):
    found = [
        outbox.take(StateChannel(), BodyChannel(), now_ns=0, pictures=pictures)
        for _ in range(count)
    ]
    return [message for message in found if message is not None]


def test_a_picture_says_whose_it_is():
    assert pack_picture("p1/s1", b"jpeg") == b"\x01\x04\x05\x00p1/s1jpeg"


def test_one_that_is_too_large_is_refused_with_the_limit():
    with pytest.raises(WireError, match=str(MAX_PICTURE_BYTES)):
        pack_picture("wall", bytes(MAX_PICTURE_BYTES + 1))


def test_the_newest_of_each_surface_goes_once_and_after_the_texts():
    outbox, pictures = Outbox(0, Sent()), PictureChannel()
    outbox.begin(["text"], version=0, token_number=1)
    for surface, jpeg in (("wall", b"1"), ("wall", b"2"), ("desk", b"3"), ("gone", b"4")):
        pictures.put(surface, jpeg)
    pictures.keep({"wall", "desk"})
    assert taken(outbox, pictures, 5) == ["text", b"2", b"3"]
    pictures.put("wall", b"5")
    assert taken(outbox, pictures, 2) == [b"5"]


def test_after_goodbye_none_is_sent():
    outbox, pictures = Outbox(0, Sent()), PictureChannel()
    pictures.put("wall", b"1")
    outbox.end("over")
    assert len(taken(outbox, pictures, 3)) == 1
