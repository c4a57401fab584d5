"""One connection: what an answer says, and that it ends."""

import asyncio

import pytest

pytest.importorskip("aiortc")

from devices.hub.media import process
from devices.hub.media.offer import OfferError, read_offer
from devices.hub.media.peers import Peer


def answered(text):
    async def answer():
        process._listen_at(["127.0.0.1"])
        peer = Peer(
            1,
            on_voice=lambda _index, _voice: None,
            wants_whole=lambda _number: None,
            changed=lambda _state: None,
        )
        try:
            return await peer.answer(text, "127.0.0.1")
        finally:
            await peer.close()

    return asyncio.run(answer())


def test_the_answer_takes_the_microphone_gives_the_rest_and_names_loopback_alone(chromium_offer):
    answer = answered(chromium_offer(voices=6, videos=4))
    directions = [line for line in answer.split("\r\n") if line[2:] in ("recvonly", "sendonly")]
    assert directions == ["a=recvonly"] + ["a=sendonly"] * 10
    assert "usedtx=1" in answer
    places = {line.split()[4] for line in answer.split("\r\n") if line.startswith("a=candidate")}
    assert places == {"127.0.0.1"}
    assert "G722" not in answer
    assert len(read_offer(answer).tracks) == 11


def test_more_tracks_than_there_are_places_stay_empty(chromium_offer):
    answer = answered(chromium_offer(voices=8, videos=6))
    assert answer.count("a=inactive") == 4


def test_what_is_no_offer_is_not_answered():
    with pytest.raises(OfferError):
        answered("v=0")
