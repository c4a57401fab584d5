"""Connections beyond the limits are closed at once; those within them go on."""

import socket
import time
from contextlib import suppress
from types import SimpleNamespace

import pytest

from devices.hub import port as module


def connect(house, count):
    host, port = house.url.split("/")[2].split(":")
    return [socket.create_connection((host, int(port)), 5) for _ in range(count)]


def wait_until_closed(wires, count, patience_s=60.0):
    """Wait until so many are closed by the hub; exactly so many, a moment later."""
    end = time.monotonic() + patience_s
    while closed(wires) < count:
        assert time.monotonic() < end, f"{closed(wires)} closed, wanted {count}"
    assert closed(wires) == count


def closed(wires):
    found = 0
    for wire in wires:
        wire.settimeout(0.02)
        try:
            found += wire.recv(10) == b""
        except TimeoutError:
            continue
        except ConnectionError:
            found += 1
    return found


def ask(wire):
    wire.settimeout(60)
    wire.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
    return wire.recv(15)


def test_too_many_connections_are_closed_and_the_others_served(house, monkeypatch):
    monkeypatch.setattr(module, "MAX_CONNECTIONS", 3)
    wires = connect(house, 6)
    wait_until_closed(wires, 3)
    assert ask(wires[0]) == b"HTTP/1.1 200 OK"
    for wire in wires:
        wire.close()
    until_served = time.monotonic() + 120
    answer = b""
    while not answer and time.monotonic() < until_served:
        (again,) = connect(house, 1)
        with again, suppress(ConnectionError):
            answer = ask(again)
    assert answer == b"HTTP/1.1 200 OK"


def test_silent_handshakes_are_counted_and_given_up(open_house, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "MAX_CONNECTIONS", 3)
    monkeypatch.setattr(module, "HANDSHAKE_S", 4.0)
    wires = connect(open_house(certificate_folder=tmp_path), 6)
    wait_until_closed(wires, 3)
    wait_until_closed(wires, 6)
    for wire in wires:
        wire.close()


@pytest.mark.parametrize(("address", "has_room"), [("10.0.0.1", False), ("127.0.0.1", True)])
def test_one_address_of_the_network_has_its_share(monkeypatch, address, has_room):
    monkeypatch.setattr(module, "MAX_FROM_ONE", 2)

    class Server:
        connections = ()

    port = module.Port(Server(), None)
    port._shaking = {1: (address, 1), 2: (address, 2), 3: ("10.0.0.2", 1)}
    assert port._has_room(address) is has_room
    assert port._has_room("10.0.0.2")


def test_who_has_just_shaken_hands_is_counted_once(monkeypatch):
    monkeypatch.setattr(module, "MAX_CONNECTIONS", 2)

    class Server:
        connections = (SimpleNamespace(peername=("10.0.0.1", 1)),)

    port = module.Port(Server(), None)
    port._shaking = {1: ("10.0.0.1", 1)}
    assert port._has_room("10.0.0.2")
    port._shaking = {1: ("10.0.0.1", 2)}
    assert not port._has_room("10.0.0.2")


def test_a_machine_without_descriptors_comes_back(house, monkeypatch):
    """Where the system refuses one more connection, the port goes on listening."""
    loop = house.hub._peers.loop
    real, failures = loop.sock_accept, []

    async def fail_once(listening):
        if not failures:
            failures.append(True)
            raise OSError(24, "Too many open files")
        return await real(listening)

    monkeypatch.setattr(loop, "sock_accept", fail_once)
    for _ in range(3):
        (wire,) = connect(house, 1)
        assert ask(wire) == b"HTTP/1.1 200 OK"
        wire.close()
    assert failures
