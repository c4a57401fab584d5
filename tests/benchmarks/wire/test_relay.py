"""A network that fails on command."""

import socket
import threading

import pytest

from benchmarks.wire.relay import TcpRelay, UdpRelay


@pytest.fixture
def echo():
    """A server that gives back what it gets."""
    listener = socket.create_server(("127.0.0.1", 0))
    over = threading.Event()

    def serve(connection):
        with connection:
            while data := connection.recv(1000):
                connection.sendall(data)

    def run():
        while not over.is_set():
            try:
                accepted, _from = listener.accept()
            except OSError:
                return
            threading.Thread(target=serve, args=(accepted,), daemon=True).start()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    yield listener.getsockname()[:2]
    over.set()
    listener.shutdown(socket.SHUT_RDWR)
    listener.close()
    thread.join()


@pytest.fixture
def relay(echo):
    made = TcpRelay(echo)
    yield made
    made.close()


def connected(relay):
    made = socket.create_connection(relay.address, 5)
    made.settimeout(5)
    return made


def answers(connection, text=b"hello"):
    connection.settimeout(0.3)
    try:
        connection.sendall(text)
        return connection.recv(100)
    except TimeoutError:
        return None
    finally:
        connection.settimeout(5)


def test_bytes_pass_both_ways(relay):
    with connected(relay) as connection:
        data = bytes(range(256)) * 2000
        sender = threading.Thread(target=connection.sendall, args=(data,))
        sender.start()
        came = b""
        while len(came) < len(data):
            came += connection.recv(1 << 16)
        sender.join()
    assert came == data
    assert relay.connections == 1


def test_a_black_hole_is_silent_and_what_was_open_stays_dead(relay):
    with connected(relay) as before:
        assert answers(before) == b"hello"
        relay.begin_hole()
        assert answers(before) is None
        with connected(relay) as within:
            assert answers(within) is None
            relay.end_hole()
            assert answers(within) is None
        assert answers(before) is None
    with connected(relay) as after:
        assert answers(after) == b"hello"


def test_half_open_connections_are_dead_beside_new_ones(relay):
    with connected(relay) as before:
        assert answers(before) == b"hello"
        relay.half_open()
        with connected(relay) as after:
            assert answers(after) == b"hello"
        assert answers(before) is None


def test_a_cut_closes_what_is_open(relay):
    with connected(relay) as before:
        assert answers(before) == b"hello"
        relay.cut()
        assert before.recv(10) == b""


def test_garbage_comes_before_the_next_piece_that_is_longer(relay):
    with connected(relay) as connection:
        relay.send_garbage(b"##")
        assert answers(connection, b"hello") in (b"##hello", b"##")


def test_nobody_behind_it_closes_the_connection():
    with socket.create_server(("127.0.0.1", 0)) as gone:
        target = gone.getsockname()[:2]
    relay = TcpRelay(target)
    with connected(relay) as connection:
        assert connection.recv(10) == b""
    relay.close()


def test_datagrams_pass_or_not():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as target:
        target.bind(("127.0.0.1", 0))
        target.settimeout(0.3)
        relay = UdpRelay(target.getsockname())
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(b"one", relay.address)
            assert target.recv(100) == b"one"
            relay.begin_hole()
            sender.sendto(b"two", relay.address)
            with pytest.raises(TimeoutError):
                target.recv(100)
            relay.end_hole()
            relay.send_garbage(b"##")
            sender.sendto(b"three", relay.address)
            assert [target.recv(100), target.recv(100)] == [b"##", b"three"]
        relay.close()
