"""A port hands out connections until it is closed, and says where it was even then."""

from __future__ import annotations

import socket

import pytest

from sim.wire.accepting import AcceptingPort


def test_connections_are_handed_out_until_it_closes():
    port = AcceptingPort("127.0.0.1", 0, name="test")
    taken = []
    port.start(taken.append)
    peers = [socket.create_connection(port.address, 5) for _ in range(3)]
    for peer in peers:
        peer.sendall(b"x")
    where = port.address
    while len(taken) < 3:
        pass
    port.close()
    port.close()
    assert port.address == where
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(where, 1)
    for one in (*peers, *taken):
        one.close()


def test_one_that_was_never_started_closes_too():
    port = AcceptingPort("127.0.0.1", 0, name="test")
    with pytest.raises(OSError, match="in use"):
        AcceptingPort(*port.address, name="second")
    port.close()
