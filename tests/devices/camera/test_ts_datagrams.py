"""UDP as a stream: one sender at a time, transport stream only, bounded."""

import socket
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera import ts_datagrams
from devices.camera.ts_datagrams import PACKET_BYTES, TsDatagrams, is_transport_stream
from devices.camera.units import SourceError


def packets(letter, count=7):
    return (b"\x47" + letter * (PACKET_BYTES - 1)) * count


@pytest.fixture
def received():
    stream = TsDatagrams("127.0.0.1", 0)
    yield stream
    stream.close()


@pytest.fixture
def sender(received):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.connect(("127.0.0.1", received.port))
        yield made


def wait_for(truth):
    end = time.monotonic() + 120
    while not truth():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_bytes_come_in_order_in_any_pieces(received, sender):
    sender.send(packets(b"a"))
    sender.send(packets(b"b"))
    wanted = packets(b"a") + packets(b"b")
    came = b""
    while len(came) < len(wanted):
        came += received.read(500)
    assert came == wanted


def test_other_senders_and_other_bytes_are_dropped_and_counted(received, sender):
    sender.send(packets(b"a"))
    assert received.read(5000) == packets(b"a")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(packets(b"x"), ("127.0.0.1", received.port))
        sender.send(b"no transport stream")
        wait_for(lambda: received.refused == 2)
        sender.send(packets(b"b"))
    assert received.read(5000) == packets(b"b")


def test_another_sender_takes_over_from_one_that_is_gone(received, sender, monkeypatch):
    monkeypatch.setattr(ts_datagrams, "SENDER_GONE_S", 0.05)
    sender.send(packets(b"a"))
    assert received.read(5000) == packets(b"a")
    time.sleep(0.1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(packets(b"x"), ("127.0.0.1", received.port))
        assert received.read(5000) == packets(b"x")


def test_what_nobody_reads_is_bounded_and_the_newest_is_kept(received, sender, monkeypatch):
    monkeypatch.setattr(ts_datagrams, "MAX_HELD_BYTES", 3 * len(packets(b"a")))
    for letter in b"abcdef":
        sender.send(packets(bytes([letter])))
        time.sleep(0.02)
    wait_for(lambda: received._held and received._held[-1] == packets(b"f"))
    assert received.read(5000) == packets(b"d")


def test_a_close_ends_who_reads():
    stream = TsDatagrams("127.0.0.1", 0)
    stream.close()
    assert stream.read(100) == b""


def test_a_taken_port_says_what_to_do(received):
    with pytest.raises(SourceError, match="give another one") as raised:
        TsDatagrams("127.0.0.1", received.port)
    assert raised.value.is_final


@given(data=st.binary(max_size=400))
def test_noise_is_no_transport_stream(data):
    assert is_transport_stream(data) == (
        len(data) == 188 * (len(data) // 188) > 0
        and all(data[at] == 0x47 for at in range(0, len(data), 188))
    )


def test_a_group_is_joined():
    try:
        stream = TsDatagrams("239.255.77.7", 0)
    except SourceError as error:
        pytest.skip(f"this machine routes no multicast: {error}")
    assert stream.port > 0
    stream.close()
