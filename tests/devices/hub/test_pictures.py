"""Pictures of live surfaces: the newest of each, after everything else, in turn."""

import asyncio

import numpy as np
import pytest

from devices.hub.channels import BodyChannel, PictureChannel, StateChannel
from devices.hub.outbox import Outbox, Sent
from devices.hub.protocol.wire import MAX_PICTURE_BYTES, WireError, pack_picture
from scenes.state import LiveSurface, SceneState, reduce_state


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


def test_a_surface_reaches_everybody_before_its_first_picture(house):
    """The only picture of a still surface is lost if it comes first."""
    corners = np.array([[0.0, 1.4, 1.5], [1.2, 1.4, 1.5], [1.2, 1.4, 0.6], [0.0, 1.4, 0.6]])

    async def talk():
        async with house.http() as http:
            anna = await house.join(http, "Anna")
            for number in range(20):
                name = f"p1/s{number}"
                surface = LiveSurface(name, corners, (640, 480), "camera-360")
                house.hub.publish(reduce_state(SceneState(), surface, number))
                house.hub.show(name, b"jpeg")
                texts = ""
                while isinstance(data := (await anna.socket.receive(5.0)).data, str):
                    texts += data
                assert data == pack_picture(name, b"jpeg")
                assert f'"{name}"' in texts, "the surface comes first"

    asyncio.run(asyncio.wait_for(talk(), 20))
