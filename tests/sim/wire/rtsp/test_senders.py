import itertools
import socket
from random import Random

import pytest

from sim.wire.rtsp.senders import TcpSender, UdpSender
from sim.wire.rtsp.transport import OverTcp, OverUdp

UNIT = b"\0\0\0\1\x65" + bytes(range(1, 250)) * 250
"""One keyframe of 45 packets: more than leave at once."""


def numbers(packets):
    return [int.from_bytes(packet[2:4], "big") for packet in packets]


@pytest.fixture
def sent():
    return []


@pytest.fixture
def tcp(sent):
    sender = TcpSender(OverTcp(4, 5), lambda channel, packets: sent.append((channel, packets)))
    sender.begin(Random(1))
    return sender


@pytest.fixture
def ports():
    """The player's two ports."""
    pair = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for each in pair:
        each.bind(("127.0.0.1", 0))
        each.settimeout(0.1)
    yield pair
    for each in pair:
        each.close()


@pytest.fixture
def udp(ports):
    wanted = OverUdp(*(each.getsockname()[1] for each in ports))
    sender = UdpSender(wanted, "127.0.0.1", "127.0.0.1")
    sender.begin(Random(1))
    yield sender
    sender.close()


def arrived(port):
    packets = []
    try:
        while True:
            packets.append(port.recv(2000))
    except TimeoutError:
        return packets


def test_over_tcp_a_unit_is_sent_or_lost_as_a_whole(tcp, sent):
    assert tcp.send(UNIT, 0, lost=False, loss=0.9)
    assert not tcp.send(UNIT, 40, lost=True, loss=0.0)
    ((channel, packets),) = sent
    assert (channel, len(packets)) == (4, 45)


def test_a_report_comes_at_once_and_then_every_five_seconds(tcp, sent):
    for second in range(12):
        tcp.report(second * 1_000_000_000, 0)
    assert [channel for channel, _ in sent] == [5, 5, 5]


def test_after_a_restart_of_the_clock_it_reports_anew(tcp, sent):
    tcp.report(9_000_000_000, 0)
    tcp.report(0, 0)
    assert len(sent) == 2


def test_garbage_has_no_frame_around_it(tcp, sent):
    tcp.send_garbage(b"abc")
    assert sent == [(None, [b"abc"])]


def test_over_udp_all_packets_come_in_order(udp, ports):
    assert udp.send(UNIT, 0, lost=True, loss=0.0)
    udp.report(0, 0)
    packets = arrived(ports[0])
    first = numbers(packets)[0]
    assert numbers(packets) == [(first + k) % 65536 for k in range(45)]
    assert arrived(ports[1])[0][:2] == b"\x80\xc8"


def test_over_udp_packets_are_lost_one_by_one_and_leave_gaps(udp, ports):
    got = []
    for second in range(10):
        udp.send(UNIT, second, lost=False, loss=0.25)
        got += numbers(arrived(ports[0]))
    assert 0.6 * 450 < len(got) < 0.9 * 450
    assert max(b - a for a, b in itertools.pairwise(got)) > 1


def test_a_player_whose_port_is_closed_is_no_error(udp, ports):
    for each in ports:
        each.close()
    for second in range(3):
        udp.send(UNIT, second, lost=False, loss=0.0)
    udp.report(9, 9)
