"""The hub's page and files: types, caching, headers, and who may have what."""

import asyncio
import socket

import pytest

from devices.hub.contract import Asset
from devices.hub.site import is_loopback
from sim.wire.people_messages import upgrade

SCRIPT = b"let a = 1;\n" * 1000


@pytest.fixture
def house(open_house, tmp_path):
    splats = tmp_path / "room.spz"
    splats.write_bytes(bytes(range(256)) * 100)
    assets = {
        "/": Asset(b"<p>the page</p>", "text/html; charset=utf-8"),
        "/assets/main-Ab3_x9Zq.js": Asset(SCRIPT, "text/javascript"),
        "/assets/room.spz": Asset(splats, "application/octet-stream", is_private=True),
        "/assets/film.bin": Asset(splats, "application/octet-stream"),
        "/assets/gone.bin": Asset(tmp_path / "gone", "application/octet-stream"),
    }
    return open_house(assets)


def get(house, path, method="GET", **headers):
    async def talk():
        async with (
            house.http() as http,
            http.request(method, path, headers=headers) as reply,
        ):
            return reply.status, reply.headers, await reply.read()

    return asyncio.run(talk())


def test_the_page_has_a_policy_and_is_asked_about_each_time(house):
    status, headers, body = get(house, "/")
    assert (status, body) == (200, b"<p>the page</p>")
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert headers["Cache-Control"] == "no-cache"
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    assert "unsafe-eval'" not in headers["Content-Security-Policy"].replace("wasm-unsafe-eval'", "")
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "aiohttp" not in headers["Server"]
    assert "Access-Control-Allow-Origin" not in headers


def test_a_file_named_by_its_content_is_kept_for_ever(house):
    _status, headers, body = get(house, "/assets/main-Ab3_x9Zq.js")
    assert "immutable" in headers["Cache-Control"]
    assert headers["Content-Encoding"] == "gzip"
    assert body == SCRIPT
    assert int(headers["Content-Length"]) < len(SCRIPT) / 10
    _status, headers, body = get(house, "/assets/main-Ab3_x9Zq.js", **{"Accept-Encoding": "br"})
    assert "Content-Encoding" not in headers
    assert body == SCRIPT


def test_what_a_browser_has_is_not_sent_again(house):
    tag = get(house, "/")[1]["ETag"]
    assert get(house, "/", **{"If-None-Match": tag})[0] == 304
    house.assets["/"] = Asset(b"<p>another</p>", "text/html")
    status, headers, body = get(house, "/", **{"If-None-Match": tag})
    assert (status, body) == (200, b"<p>another</p>")
    assert headers["ETag"] != tag


def test_files_on_the_disk_come_in_parts_too(house):
    status, headers, body = get(house, "/assets/film.bin", Range="bytes=10-19")
    assert (status, body) == (206, bytes(range(10, 20)))
    assert headers["Content-Type"] == "application/octet-stream"
    assert get(house, "/assets/film.bin", Range="bytes=99999999-")[0] == 416
    assert get(house, "/assets/film.bin", method="HEAD")[2] == b""


@pytest.mark.parametrize(
    "path",
    ["/nothing", "/assets/gone.bin", "/assets/../../etc/passwd", "/assets/%2e%2e/x", "/root.crt"],
)
def test_there_is_nothing_else(house, path):
    assert get(house, path)[0] == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_files_are_only_read(house, method):
    assert get(house, "/", method=method)[0] == 405
    assert get(house, "/pair")[0] == 405
    assert get(house, "/people")[0] == 426


def test_a_private_file_is_for_people_in_the_session(house):
    async def talk():
        async with house.http() as http:
            token = await house.pair(http)
            found = []
            for header in ({}, {"Authorization": "Bearer x"}, {"Authorization": token}):
                async with http.get("/assets/room.spz", headers=header) as reply:
                    found.append(reply.status)
            assert found == [401] * 3
            header = {"Authorization": f"Bearer {token}"}
            async with http.get("/assets/room.spz", headers=header) as reply:
                assert reply.status == 200
                assert reply.headers["Cache-Control"].startswith("private")
            house.hub.revoke("x")
            anna = await house.enter(http, token)
            house.hub.remove(anna.person_id)
            async with http.get("/assets/room.spz", headers=header) as reply:
                assert reply.status == 401

    asyncio.run(talk())
    assert house.hub.counts().refused == {"token": 4}


def test_a_defect_is_said_and_shows_nothing(house):
    house.assets["/"] = None  # no asset at all
    house.assets["/broken"] = "no asset"
    status, _headers, body = get(house, "/broken")
    assert status == 500
    assert b"AttributeError" not in body
    assert house.said[-1].startswith("people: defect in the hub: AttributeError at site.py:")
    assert get(house, "/")[0] == 404


def test_an_upgrade_with_a_value_that_is_no_text_is_refused_without_a_defect(house):
    host, port = house.url.split("/")[2].split(":")
    request, replies = upgrade((host, int(port))), set()
    for end in [at for at in range(len(request)) if request[at : at + 2] == b"\r\n"][1:-1]:
        with socket.create_connection((host, int(port)), 5) as wire:
            wire.sendall(request[: end - 1] + b"\xe4" + request[end:])
            replies.add(wire.makefile("rb").readline()[9:12])
    assert replies == {b"400"}
    assert house.hub.counts().refused == {"header": 5}
    assert not [line for line in house.said if "defect" in line]


def test_headers_without_an_end_and_silence_are_given_up(house, monkeypatch):
    host, port = house.url.split("/")[2].split(":")
    with socket.create_connection((host, int(port)), 5) as wire:
        wire.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"y" * 100_000)
        answer = wire.recv(100)
    assert b" 400 " in answer or b" 431 " in answer


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("192.168.1.2", False),
        ("localhost.evil.example", False),
        ("", False),
    ],
)
def test_loopback(host, expected):
    assert is_loopback(host) is expected
