import socket
import threading
import time
from random import Random

import pytest

from benchmarks.wire.attack_hub import attack
from sim.wire.rtsp import server as module
from sim.wire.rtsp.requests import reply
from sim.wire.rtsp.server import RtspFaults, RtspServer, RtspStream, StreamUnit

UNIT = StreamUnit(0, b"\0\0\0\1\x65" + bytes(range(1, 200)) * 20)


class Endless:
    """The same unit over and over."""

    def __init__(self):
        self.closed = 0

    def __call__(self):
        return self

    def take(self, timeout_s):
        time.sleep(min(timeout_s, 0.005))
        return UNIT

    def sent(self, unit):
        pass

    def close(self):
        self.closed += 1


@pytest.fixture
def viewing():
    return Endless()


@pytest.fixture
def server(viewing):
    stream = RtspStream("room", lambda host: f"v=0 {host}\r\n", viewing, time.time_ns)
    made = RtspServer(stream, Random(1))
    yield made
    made.close()


class Player:
    """A player of bare requests."""

    def __init__(self, server):
        self.socket = socket.create_connection(server.address, 5)
        self._url = f"rtsp://127.0.0.1:{server.address[1]}/room"
        self._cseq = 0

    def ask(self, method, url=None, **headers):
        """Status code and headers of the reply, with what follows it in "rest"."""
        self._cseq += 1
        lines = [f"{method} {url or self._url} RTSP/1.0", f"CSeq: {self._cseq}"]
        lines += [f"{name}: {value}" for name, value in headers.items()]
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        data = b""
        while b"\r\n\r\n" not in data:
            more = self.socket.recv(4096)
            assert more, data
            data += more
        head, _, rest = data.partition(b"\r\n\r\n")
        first, *others = head.decode().split("\r\n")
        found = dict(line.split(": ", 1) for line in others)
        assert found["CSeq"] == str(self._cseq)
        return int(first.split()[1]), found, rest

    def set_up(self):
        code, headers, _ = self.ask("SETUP", Transport="RTP/AVP/TCP;interleaved=4-5")
        assert code == 200
        return headers["Session"].partition(";")[0]


@pytest.fixture
def player(server):
    made = Player(server)
    yield made
    made.socket.close()


def test_a_player_gets_what_it_asks_for_in_order(player, server, viewing):
    code, headers, _ = player.ask("OPTIONS", "*")
    assert (code, "DESCRIBE" in headers["Public"]) == (200, True)
    code, headers, rest = player.ask("DESCRIBE")
    assert (code, headers["Content-Type"], rest) == (200, "application/sdp", b"v=0 127.0.0.1\r\n")
    session = player.set_up()
    code, _, rest = player.ask("PLAY", Session=session)
    data = rest or player.socket.recv(4096)
    assert (code, data[:2]) == (200, b"$\x04")
    assert server.plays == 1


@pytest.mark.parametrize(
    ("method", "url", "headers", "code"),
    [
        ("DESCRIBE", "rtsp://127.0.0.1/other", {}, 404),
        ("DESCRIBE", None, {"Require": "funky"}, 551),
        ("PLAY", None, {}, 455),
        ("TEARDOWN", None, {}, 455),
        ("PLAY", None, {"Session": "guess"}, 454),
        ("SETUP", None, {"Transport": "RTP/AVP;multicast"}, 461),
        ("RECORD", None, {}, 405),
        ("GET_PARAMETER", None, {}, 200),
    ],
)
def test_what_cannot_be_is_refused_and_the_connection_stays(player, method, url, headers, code):
    assert player.ask(method, url, **headers)[0] == code
    if method != "TEARDOWN":
        assert player.ask("OPTIONS")[0] == 200


def test_a_second_set_up_is_refused(player):
    player.set_up()
    assert player.ask("SETUP", Transport="RTP/AVP/TCP")[0] == 455


def test_after_a_teardown_the_viewing_is_over(player, viewing):
    session = player.set_up()
    assert player.ask("TEARDOWN", Session=session)[0] == 200
    assert player.socket.recv(10) == b""


def test_a_player_that_leaves_ends_its_viewing(player, viewing):
    player.ask("PLAY", Session=player.set_up())
    player.socket.close()
    end = time.monotonic() + 120
    while not viewing.closed and time.monotonic() < end:
        time.sleep(0.02)
    assert viewing.closed == 1


def test_there_is_a_limit_of_players(server):
    players = [Player(server) for _ in range(module.MAX_CLIENTS)]
    for player in players:
        assert player.ask("OPTIONS")[0] == 200
    late = socket.create_connection(server.address, 5)
    assert late.recv(100) == reply(503, 0)
    players[0].socket.close()
    end = time.monotonic() + 120
    while time.monotonic() < end:
        time.sleep(0.3)
        again = Player(server)
        try:
            if again.ask("OPTIONS")[0] == 200:
                break
        except (AssertionError, OSError, KeyError):
            continue
    else:
        pytest.fail("no room was made")
    for player in (*players, again):
        player.socket.close()
    late.close()


def test_packets_go_to_whoever_asks_and_not_to_a_destination(player):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rtp:
        rtp.bind(("127.0.0.1", 0))
        rtp.settimeout(5)
        port = rtp.getsockname()[1]
        wanted = f"RTP/AVP;unicast;destination=192.0.2.1;client_port={port}-{port % 65535 + 1}"
        code, headers, _ = player.ask("SETUP", Transport=wanted)
        assert (code, "server_port=" in headers["Transport"]) == (200, True)
        assert "destination" not in headers["Transport"]
        player.ask("PLAY", Session=headers["Session"].partition(";")[0])
        assert rtp.recvfrom(2000)[1][0] == "127.0.0.1"


def test_silent_it_neither_sends_nor_answers(server, player):
    server.faults = RtspFaults(silent=True)
    player.socket.settimeout(0.5)
    time.sleep(0.3)
    with pytest.raises(TimeoutError):
        player.ask("OPTIONS")
    server.faults = RtspFaults()
    player.socket.settimeout(5)
    assert player.socket.recv(100).startswith(b"RTSP/1.0 200")


def test_garbage_comes_between_packets(server, player):
    session = player.set_up()
    server.faults = RtspFaults(garbage_bytes=64)
    _, _, data = player.ask("PLAY", Session=session)
    while len(data) < 68:
        data += player.socket.recv(4096)
    assert data[:2] != b"$\x04"


VALID = (
    b"OPTIONS * RTSP/1.0\r\nCSeq: 1\r\n\r\n",
    b"DESCRIBE rtsp://127.0.0.1/room RTSP/1.0\r\nCSeq: 2\r\n\r\n",
    b"SETUP rtsp://h/room/trackID=0 RTSP/1.0\r\nCSeq: 3\r\nTransport: RTP/AVP/TCP\r\n\r\n",
    b"$\x01\x00\x04abcd",
)


def test_it_survives_hostile_clients(server):
    attack(server.address, VALID, 60, first_seed=5)
    assert Player(server).ask("OPTIONS")[0] == 200
    end = time.monotonic() + 120
    names = ("camera RTSP reads", "camera RTSP sends")
    while time.monotonic() < end:
        if sum(thread.name in names for thread in threading.enumerate()) <= 1:
            return
        time.sleep(0.05)
    pytest.fail("threads are left")
