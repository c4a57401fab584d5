"""The hub on real sockets of loopback: people see each other and the room, whatever one does."""

import asyncio
import threading
import time

import aiohttp
import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.protocol.messages import MAX_TEXT_BYTES
from devices.hub.protocol.wire import unpack_bodies
from devices.hub.roles import Role
from devices.hub.server import Hub
from scenes.state import Annotation, reduce_state

LINE = {"kind": "do", "id": 1, "op": "line", "line": "a", "points": [[0, 1, 0], [1, 1, 0]]}


async def until(is_true, patience_s=60.0):
    """Wait for something that the hub's thread does."""
    async with asyncio.timeout(patience_s):
        while not is_true():
            await asyncio.sleep(0.005)


def test_two_people_see_each_other_and_the_room(house, state_at, body_at):
    async def talk(http):
        house.hub.publish(state_at(1.0))
        anna = await house.join(http, "Anna")
        ben = await house.join(http, "Ben")
        assert ben.welcome["state"]["objects"]["cup"][0] == 1
        await anna.socket.send_bytes(body_at(2.0))
        assert unpack_bodies(await ben.next("bodies")) == ((1, body_at(2.0)),)
        await ben.socket.send_bytes(body_at(3.0))
        assert unpack_bodies(await anna.next("bodies")) == ((2, body_at(3.0)),)
        await anna.send(**LINE)
        for person in (anna, ben):
            assert (await person.next("log"))["line"] == "p1/a"
        assert (await anna.next("done"))["id"] == 1
        house.hub.publish(state_at(5.0, 2))
        assert (await ben.next("state"))["objects"]["cup"][0] == 5

    house.run(talk)
    arrived = house.hub.take()
    assert [it.user_id for it in arrived.avatars] == ["p1", "p2"]
    assert [it.annotation_id for it in arrived.lines] == ["p1/a"]
    assert [kind for kind, _text in arrived.events][:4] == ["paired", "joined"] * 2
    counts = house.hub.counts()
    assert counts.sent_messages >= 8
    assert counts.sent_bytes > 1000


def test_role_and_muting_while_connected(house, body_at):
    async def talk(http):
        anna = await house.join(http, "Anna", Role.SPECTATOR)
        await anna.send(**LINE)
        assert "may not" in (await anna.next("refused"))["why"]
        house.hub.set_role("p1", Role.LOCAL)
        assert (await anna.next("rights"))["role"] == "local"
        await anna.send(**LINE)
        await anna.next("done")
        house.hub.mute("p1", is_muted=True)
        assert (await anna.next("rights"))["muted"]
        await anna.send(**LINE)
        assert (await anna.next("refused"))["why"] == "you are muted"
        await anna.socket.send_bytes(body_at(1.0))
        await anna.send(kind="ping", t_us=1)
        await anna.next("pong")

    house.run(talk)
    assert house.hub.take().avatars == ()
    assert house.hub.counts().refused == {"op": 2, "muted": 1}


def test_who_comes_back_is_the_same_and_misses_nothing(house):
    async def talk(http):
        anna = await house.join(http, "Anna")
        ben = await house.join(http, "Ben")
        await anna.send(**LINE)
        seq = (await ben.next("log"))["seq"]
        ben.socket._response.connection.transport.abort()
        await until(lambda: [p.is_connected for p in house.hub.people()] == [True, False])
        for number in range(3):
            await anna.send(**{**LINE, "line": f"b{number}"})
            await anna.next("done")
        again = await house.enter(http, ben.welcome["token"], log_seq=seq)
        assert again.person_id == "p2"
        assert again.welcome["resumed"]
        missed = [await again.next("log") for _ in range(3)]
        assert [it["seq"] for it in missed] == [2, 3, 4]

    house.run(talk)


def test_a_slow_client_gets_the_newest_state_and_others_are_not_slowed(house, state_at):
    async def talk(http):
        slow = await house.join(http, "Slow")
        quick = await house.join(http, "Quick")
        for number in range(1, 101):
            house.hub.publish(state_at(float(number), number))
            state = await quick.next("state")
            assert state["objects"]["cup"][0] == number
            await quick.send(kind="seen", version=state["version"])
        first, second = await slow.next("state"), await slow.next("state")
        assert (first["version"], second["version"]) == (1, 2)
        await slow.send(kind="seen", version=2)
        assert (await slow.next("state"))["objects"]["cup"][0] == 100

    house.run(talk)
    assert house.hub.counts().dropped == 97


def test_hostile_messages_end_their_own_connection_alone(house, body_at):
    async def talk(http):
        anna = await house.join(http, "Anna")
        for data in (b"x" * (MAX_TEXT_BYTES + 1), "x" * (MAX_TEXT_BYTES + 1)):
            eve = await house.join(http, "Eve")
            send = eve.socket.send_bytes if isinstance(data, bytes) else eve.socket.send_str
            await send(data)
            assert (await eve.next("end")).data == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
        whole = body_at(1.0)
        eve = await house.join(http, "Eve")
        for at in range(len(whole)):
            if eve.socket.closed or "bye" in [it["kind"] for it in eve.texts]:
                eve = await house.join(http, "Eve")
            await eve.socket.send_bytes(whole[:at])
            await eve.send(kind="ping", t_us=at)
            await eve.next("pong" if at % 21 != 20 else "bye")
        await anna.send(**LINE)
        await anna.next("done")

    house.run(talk)
    assert house.hub.counts().refused["message"] == len(body_at(1.0)) + 2
    assert house.hub.take().avatars == ()


def test_latency_is_measured(house, monkeypatch):
    monkeypatch.setattr("devices.hub.connection.PING_NS", 10**7)

    async def talk(http):
        anna = await house.join(http)
        waiting = asyncio.ensure_future(anna.next("end"))  # reads, so that pings are answered
        await until(lambda: house.hub.people()[0].latency_ms is not None)
        assert 0 < house.hub.people()[0].latency_ms < 1000
        await anna.socket.close()
        await waiting
        await until(lambda: house.hub.people()[0].latency_ms is None)

    house.run(talk)


def test_who_falls_silent_loses_the_connection(house, monkeypatch):
    monkeypatch.setattr("devices.hub.connection.PING_NS", 10**7)
    monkeypatch.setattr("devices.hub.connection.SILENT_NS", 10**8)

    async def talk(http):
        await house.join(http)  # nobody reads there: pings stay without an answer
        await until(lambda: not house.hub.people()[0].is_connected)

    house.run(talk)


def test_publishing_costs_the_caller_nothing(house, state_at):
    async def talk(http):
        for number in range(4):
            await house.join(http, str(number))
        states = [state_at(float(number), number) for number in range(300)]
        spent = []
        for state in states:
            begin = time.perf_counter()
            house.hub.publish(state)
            spent.append(time.perf_counter() - begin)
        assert sorted(spent)[150] < 0.001

    house.run(talk)


def test_a_state_that_cannot_be_sent_is_said_and_the_next_one_goes(house, state_at):
    async def talk(http):
        anna = await house.join(http)
        bad = Annotation("bad", "designer", np.zeros((1, 3)), (float("nan"), 0.0, 0.0))
        house.hub.publish(reduce_state(state_at(1.0), bad, 1))
        await until(lambda: any("defect" in line for line in house.said))
        house.hub.publish(state_at(2.0, 2))
        assert (await anna.next("state"))["objects"]["cup"][0] == 2

    house.run(talk)
    defects = [line for line in house.said if "defect in the hub" in line]
    assert [line.split(" at ")[0] for line in defects] == ["people: defect in the hub: ValueError"]


def test_any_thread_may_ask(house):
    async def talk(http):
        await house.join(http)
        done = []

        def ask():
            for _ in range(50):
                house.hub.take()
                house.hub.people()
                house.hub.mute("p1", is_muted=True)
                house.hub.invite()
                house.hub.counts()
            done.append(True)

        threads = [threading.Thread(target=ask) for _ in range(4)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            await asyncio.sleep(0.01)
        assert len(done) == 4

    house.run(talk)


def test_closing_says_goodbye_and_frees_the_port(house):
    async def talk(http):
        anna = await house.join(http)
        house.hub.close()
        assert (await anna.next("bye"))["why"] == "the session is over"
        await anna.next("end")

    house.run(talk)
    port = int(house.url.rsplit(":", 1)[1].rstrip("/"))
    again = Hub(HubSettings(port=port), {}, clock=WallClock())
    again.start()
    again.publish(None)
    again.close()
    again.close()


def test_a_taken_port_is_an_error(house):
    port = int(house.url.rsplit(":", 1)[1].rstrip("/"))
    hub = Hub(HubSettings(port=port), {}, clock=WallClock())
    with pytest.raises(OSError, match="Address already in use"):
        hub.start()
    hub.close()
    with pytest.raises(RuntimeError, match="before"):
        house.hub.start()
