"""A client that takes nothing: what waits for it stays small, and it is given up."""

import asyncio
import json
import socket

import pytest

from devices.hub import connection
from devices.hub.outbox import MAX_TEXT_BYTES

LONG = [[i / 100, 1.2345, 2.3456] for i in range(1000)]


async def until(is_true, patience_s=120.0):
    async with asyncio.timeout(patience_s):
        while not is_true():
            await asyncio.sleep(0.01)


async def stop_reading(client):
    """The client's side takes some kilobytes more, then the hub's data wait at the hub."""
    transport = client.socket._response.connection.transport
    wire = transport.get_extra_info("socket")
    wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    transport.pause_reading()


def test_who_takes_no_log_is_dropped_and_others_get_all_of_it(house):
    async def talk():
        async with house.http() as http:
            anna = await house.join(http, "Anna")
            slow = await house.join(http, "Slow")
            await stop_reading(slow)
            for number in range(78):
                await anna.send(kind="do", id=number, op="line", line="a", points=LONG)
                await anna.next("done")
            outbox = house.hub._session.attendance.find("p2").outbox
            if outbox is not None:
                assert outbox._text_bytes <= MAX_TEXT_BYTES
            logs = [it["seq"] for it in anna.texts if it["kind"] == "log"]
            assert logs == list(range(1, 79))

    asyncio.run(talk())
    guest = house.hub._session.attendance.find("p2")
    assert guest.outbox is None or guest.outbox.is_overfull or guest.outbox._text_bytes < 2**20


def test_a_client_that_is_stuck_is_given_up(house, monkeypatch, body_at):
    monkeypatch.setattr(connection, "STUCK_NS", 3 * 10**8)

    async def talk():
        async with house.http() as http:
            anna = await house.join(http, "Anna")
            slow = await house.join(http, "Slow")
            await stop_reading(slow)
            seq = 0
            while house.hub.people()[1].is_connected:
                seq += 1
                await anna.send(kind="do", id=seq, op="line", line="a", points=LONG)
                await slow.send(kind="ping", t_us=seq)
                await anna.next("done")
                await asyncio.sleep(0.05)
                assert seq < 200

    asyncio.run(asyncio.wait_for(talk(), 14))


def test_bodies_that_a_slow_client_misses_are_counted_not_kept(house, body_at):
    async def talk():
        async with house.http() as http:
            anna = await house.join(http, "Anna")
            ben = await house.join(http, "Ben")
            for seq in range(1, 200):
                await anna.socket.send_bytes(body_at(seq / 10, seq))
                await asyncio.sleep(0.002)
            await ben.next("bodies")
            await asyncio.sleep(0.1)
            got = 1
            while True:
                try:
                    await asyncio.wait_for(ben.next("bodies"), 0.2)
                except TimeoutError:
                    break
                got += 1
            return got

    got = asyncio.run(asyncio.wait_for(talk(), 14))
    counts = house.hub.counts()
    assert got + counts.dropped + counts.refused.get("rate", 0) == 199
    assert got <= 90


@pytest.mark.parametrize("word", ["welcome", "people"])
def test_the_first_words_to_a_client(house, word):
    async def talk():
        async with house.http() as http:
            anna = await house.join(http)
            if word == "people":
                return await anna.next("people")
            return anna.welcome

    assert json.dumps(asyncio.run(talk())["people"]).count("Anna") == 1
