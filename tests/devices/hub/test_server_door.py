"""The hub's door on real sockets of loopback: who gets in, who does not, and what nobody learns."""

import asyncio
import json
import logging
import ssl

import aiohttp
import pytest

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.entry.pairing import MAX_WRONG
from devices.hub.roles import Role
from devices.hub.server import Hub


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

    house.run(talk)
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

    house.run(talk)


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

    house.run(talk)


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

    house.run(talk)
    kind = "origin" if status == 403 else "host"
    assert house.hub.counts().refused == {kind: 2}


def test_tokens_that_are_not_good(open_house, house):
    async def elsewhere(http):
        return await other.pair(http)

    other = open_house()
    foreign = other.run(elsewhere)

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

    house.run(talk)
    assert house.hub.counts().refused == {"token": 3}


def test_a_removed_person_is_told_and_stays_out(house):
    async def talk(http):
        anna = await house.join(http)
        house.hub.remove("p1")
        assert "removed" in (await anna.next("bye"))["why"]
        await anna.next("end")
        again = await house.enter(http, anna.welcome["token"])
        assert again.welcome["kind"] == "bye"

    house.run(talk)
    assert house.hub.people() == ()
    with pytest.raises(KeyError):
        house.hub.remove("p1")


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

    house.run(talk)


def test_the_room_is_full(open_house):
    house = open_house(max_people=1)

    async def talk(http):
        late = await house.pair(http, "Late")
        await house.join(http)
        assert "full" in (await house.enter(http, late)).welcome["why"]
        code = house.hub.invite().code
        async with http.post("/pair", json={"code": code}) as reply:
            assert reply.status == 503

    house.run(talk)


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

    tokens = house.run(talk)
    house.hub.close()
    said = "\n".join([*house.said, *asked, *(r.getMessage() for r in caplog.records)])
    ours = [r for r in caplog.records if not r.name.startswith("asyncio")]
    assert not [r for r in ours if "hub" in r.name or "aiohttp" in r.name]
    for secret in (invitation.code, *tokens):
        assert secret not in said


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
