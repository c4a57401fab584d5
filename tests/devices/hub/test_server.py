"""The hub on real sockets of loopback: people come in, see each other, and hostile ones do not."""

import asyncio
import json
import logging
import ssl
import threading
import time

import aiohttp
import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.entry.pairing import MAX_WRONG
from devices.hub.messages import MAX_TEXT_BYTES
from devices.hub.roles import Role
from devices.hub.server import Hub
from devices.hub.wire import unpack_bodies
from scenes.state import Annotation, reduce_state

LINE = {"kind": "do", "id": 1, "op": "line", "line": "a", "points": [[0, 1, 0], [1, 1, 0]]}


async def until(is_true, patience_s=5.0):
    """Wait for something that the hub's thread does."""
    async with asyncio.timeout(patience_s):
        while not is_true():
            await asyncio.sleep(0.005)


def run(house, talk):
    async def within():
        async with house.http() as http:
            return await talk(http)

    return asyncio.run(asyncio.wait_for(within(), 15))


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

    run(house, talk)
    arrived = house.hub.take()
    assert [it.user_id for it in arrived.avatars] == ["p1", "p2"]
    assert [it.annotation_id for it in arrived.lines] == ["p1/a"]
    assert [kind for kind, _text in arrived.events][:4] == ["paired", "joined"] * 2
    counts = house.hub.counts()
    assert counts.sent_messages >= 8
    assert counts.sent_bytes > 1000


def test_a_wrong_code_and_then_guessing(house):
    async def talk(http):
        code = house.hub.invite().code
        wrong = f"{(int(code) + 1) % 10**6:06d}"
        statuses = []
        for tried in [wrong] * (MAX_WRONG + 1) + [code]:
            async with http.post("/pair", json={"code": tried, "name": "Eve"}) as reply:
                statuses.append(reply.status)
                assert tried not in await reply.text()
        assert statuses == [403] * MAX_WRONG + [429] * 2

    run(house, talk)
    assert house.hub.counts().refused == {"code": MAX_WRONG, "guessing": 2}


def test_a_code_is_used_once_and_can_be_revoked(house):
    async def talk(http):
        used, revoked = house.hub.invite().code, house.hub.invite(Role.OPERATOR).code
        house.hub.revoke(revoked)
        found = []
        for code in (used, used, revoked):
            async with http.post("/pair", json={"code": code}) as reply:
                found.append(reply.status)
        assert found == [200, 403, 403]

    run(house, talk)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"{", 400),
        (b"[]", 400),
        (b'{"code":5}', 400),
        (b'{"code":"1","name":7}', 400),
        (b'{"code":"1","x":"' + b"y" * 5000 + b'"}', 400),
        (b"\xff" * 20, 400),
    ],
    ids=lambda it: str(it)[:20],
)
def test_what_is_no_request_to_pair_is_refused(house, body, status):
    async def talk(http):
        async with http.post("/pair", data=body) as reply:
            assert reply.status == status
            assert "why" in await reply.json()

    run(house, talk)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Host": "evil.example", "Origin": "http://evil.example"}, 421),
        ({"Host": ""}, 421),
    ],
    ids=str,
)
def test_pages_of_others_neither_pair_nor_connect(house, headers, status):
    async def talk(http):
        code = house.hub.invite().code
        async with http.post("/pair", json={"code": code}, headers=headers) as reply:
            assert reply.status == status
        with pytest.raises(aiohttp.WSServerHandshakeError) as caught:
            await http.ws_connect("/people", headers=headers)
        assert caught.value.status == status
        own = {"Origin": house.url.rstrip("/")}
        async with http.post("/pair", json={"code": code}, headers=own) as reply:
            assert reply.status == 200
        socket = await http.ws_connect("/people", headers=own)
        await socket.close()

    run(house, talk)
    kind = "origin" if status == 403 else "host"
    assert house.hub.counts().refused == {kind: 2}


def test_tokens_that_are_not_good(open_house, house):
    async def elsewhere(http):
        return await other.pair(http)

    other = open_house()
    foreign = run(other, elsewhere)

    async def talk(http):
        anna = await house.join(http)
        await anna.send(kind="seen", version=0)
        replayed = await house.pair(http, "Ben")
        ben = await house.enter(http, replayed)
        await ben.send(kind="seen", version=0)
        await ben.send(kind="ping", t_us=1)
        await ben.next("pong")
        for token, why in (
            (foreign, "not of this session"),
            (replayed, "replaced"),
            ("x", "not of this session"),
        ):
            bad = await house.enter(http, token)
            assert bad.welcome["kind"] == "bye"
            assert why in bad.welcome["why"]
            assert (await bad.next("end")).data == aiohttp.WSCloseCode.POLICY_VIOLATION
        assert not ben.socket.closed

    run(house, talk)
    assert house.hub.counts().refused == {"token": 3}


def test_a_removed_person_is_told_and_stays_out(house):
    async def talk(http):
        anna = await house.join(http)
        house.hub.remove("p1")
        assert "removed" in (await anna.next("bye"))["why"]
        await anna.next("end")
        again = await house.enter(http, anna.welcome["token"])
        assert again.welcome["kind"] == "bye"

    run(house, talk)
    assert house.hub.people() == ()
    with pytest.raises(KeyError):
        house.hub.remove("p1")


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

    run(house, talk)
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

    run(house, talk)


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

    run(house, talk)
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

    run(house, talk)
    assert house.hub.counts().refused["message"] == len(body_at(1.0)) + 2
    assert house.hub.take().avatars == ()


@pytest.mark.parametrize("first", ["{", '{"kind":"seen","version":1}', b"\1\1", "x" * 200_000])
def test_a_connection_begins_with_hello(house, first):
    async def talk(http):
        socket = await http.ws_connect("/people")
        await (socket.send_bytes if isinstance(first, bytes) else socket.send_str)(first)
        message = await socket.receive(timeout=5)
        if message.type is aiohttp.WSMsgType.TEXT:
            assert json.loads(message.data)["kind"] == "bye"
        else:
            assert message.type is aiohttp.WSMsgType.CLOSE

    run(house, talk)


def test_the_room_is_full(open_house):
    house = open_house(max_people=1)

    async def talk(http):
        late = await house.pair(http, "Late")
        await house.join(http)
        assert "full" in (await house.enter(http, late)).welcome["why"]
        code = house.hub.invite().code
        async with http.post("/pair", json={"code": code}) as reply:
            assert reply.status == 503

    run(house, talk)


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

    run(house, talk)


def test_who_falls_silent_loses_the_connection(house, monkeypatch):
    monkeypatch.setattr("devices.hub.connection.PING_NS", 10**7)
    monkeypatch.setattr("devices.hub.connection.SILENT_NS", 10**8)

    async def talk(http):
        await house.join(http)  # nobody reads there: pings stay without an answer
        await until(lambda: not house.hub.people()[0].is_connected)

    run(house, talk)


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

    run(house, talk)


def test_a_state_that_cannot_be_sent_is_said_and_the_next_one_goes(house, state_at):
    async def talk(http):
        anna = await house.join(http)
        bad = Annotation("bad", "designer", np.zeros((1, 3)), (float("nan"), 0.0, 0.0))
        house.hub.publish(reduce_state(state_at(1.0), bad, 1))
        await until(lambda: any("defect" in line for line in house.said))
        house.hub.publish(state_at(2.0, 2))
        assert (await anna.next("state"))["objects"]["cup"][0] == 2

    run(house, talk)
    assert house.said.count("people: defect in the hub: ValueError") == 1


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

    run(house, talk)


def test_no_secret_is_in_a_line_a_log_or_a_path(house, caplog):
    caplog.set_level(logging.DEBUG)
    invitation = house.hub.invite()
    assert invitation.url == f"{house.url}#code={invitation.code}"
    asked = []

    async def talk(http):
        token = await house.pair(http)
        async with http.post("/pair", json={"code": invitation.code}) as reply:
            asked.append(str(reply.url))
        anna = await house.enter(http, token)
        await anna.send(kind="hello", token=anna.welcome["token"])
        async with http.get(f"/assets/{token}") as reply:
            assert token not in await reply.text()
        return token, anna.welcome["token"]

    tokens = run(house, talk)
    house.hub.close()
    said = "\n".join([*house.said, *asked, *(r.getMessage() for r in caplog.records)])
    ours = [r for r in caplog.records if not r.name.startswith("asyncio")]
    assert not [r for r in ours if "hub" in r.name or "aiohttp" in r.name]
    for secret in (invitation.code, *tokens):
        assert secret not in said


def test_closing_says_goodbye_and_frees_the_port(house):
    async def talk(http):
        anna = await house.join(http)
        house.hub.close()
        assert (await anna.next("bye"))["why"] == "the session is over"
        await anna.next("end")

    run(house, talk)
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


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "::", ""])
def test_nothing_is_open_to_the_network_without_a_certificate(host):
    with pytest.raises(ValueError, match="give a certificate_folder"):
        Hub(HubSettings(host=host), {}, clock=WallClock())


def test_over_tls_with_the_root_installed(open_house, tmp_path):
    house = open_house(certificate_folder=tmp_path / "certificates", names=("studio.lan",))
    assert house.url.startswith("https://127.0.0.1:")

    async def talk():
        trusting = ssl.create_default_context(cadata=house.hub.root_pem.decode())
        connector = aiohttp.TCPConnector(ssl=trusting)
        async with aiohttp.ClientSession(house.url, connector=connector) as http:
            async with http.get("/root.crt") as reply:
                assert await reply.read() == house.hub.root_pem
                assert reply.content_type == "application/x-x509-ca-cert"
            anna = await house.join(http)
            assert anna.person_id == "p1"
            async with http.get("/", headers={"Host": "studio.lan"}) as reply:
                assert reply.status == 200
        async with aiohttp.ClientSession(house.url) as http:
            with pytest.raises(aiohttp.ClientConnectorCertificateError):
                await http.get("/")

    asyncio.run(talk())


def test_bytes_that_are_no_http_or_tls(house, open_house, tmp_path):
    secure = open_house(certificate_folder=tmp_path)

    async def shout(url, data):
        host, port = url.split("/")[2].split(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        writer.write(data)
        answer = await asyncio.wait_for(reader.read(200), 5)
        writer.close()
        return answer

    async def talk():
        for data in (
            b"\0" * 100 + b"\r\n\r\n",
            b"GET\r\n\r\n",
            b"\x16\x03\1" + b"\xff" * 50 + b"\n\n",
        ):
            answer = await shout(house.url, data)
            assert b"400" in answer
            await shout(secure.url, data)
        async with secure_session(secure) as http:
            assert (await secure.join(http)).person_id == "p1"

    def secure_session(it):
        trusting = ssl.create_default_context(cadata=it.hub.root_pem.decode())
        return aiohttp.ClientSession(it.url, connector=aiohttp.TCPConnector(ssl=trusting))

    asyncio.run(talk())
