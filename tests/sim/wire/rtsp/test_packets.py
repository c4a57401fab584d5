import base64

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.wire.flv_packets import nal_units
from sim.wire.rtsp.packets import MAX_BYTES, Packetiser, session_description

UNITS = st.lists(
    st.builds(
        lambda kind, size: bytes([kind]) + bytes([7]) * size,
        st.sampled_from([0x67, 0x68, 0x06, 0x65, 0x41]),
        st.integers(1, 5000),
    ),
    min_size=1,
    max_size=6,
)


def unpacked(packets):
    """The units of an access unit's packets, written from RFC 6184 apart from what makes them."""
    units, part = [], b""
    for packet in packets:
        payload = packet[12:]
        kind = payload[0] & 31
        if kind == 24:
            at = 1
            while at < len(payload):
                size = int.from_bytes(payload[at : at + 2], "big")
                units.append(payload[at + 2 : at + 2 + size])
                at += 2 + size
        elif kind == 28:
            if payload[1] & 0x80:
                part = bytes([payload[0] & 0xE0 | payload[1] & 31])
            part += payload[2:]
            if payload[1] & 0x40:
                units.append(part)
        else:
            units.append(payload)
    return units


@given(UNITS, st.integers(0, 2**16 - 1), st.integers(0, 10**15))
def test_what_is_packed_is_unpacked(units, first, t_ns):
    annex_b = b"".join(b"\0\0\0\1" + unit for unit in units)
    packetiser = Packetiser(0x12345678, first, 5)
    packets = list(packetiser.packets_of(annex_b, t_ns))
    assert unpacked(packets) == nal_units(annex_b) == units
    assert all(len(packet) <= MAX_BYTES for packet in packets)
    numbers = [int.from_bytes(packet[2:4], "big") for packet in packets]
    assert numbers == [(first + k) % 65536 for k in range(len(packets))]
    assert [packet[1] >> 7 for packet in packets] == [0] * (len(packets) - 1) + [1]
    ticks = {int.from_bytes(packet[4:8], "big") for packet in packets}
    assert ticks == {(5 + t_ns * 9 // 100_000) % 2**32}


def test_a_report_says_when_which_time_was_and_how_much_was_sent():
    packetiser = Packetiser(9, 0, 0)
    sent = list(packetiser.packets_of(b"\0\0\0\1\x65" + bytes([1]) * 3000, 0))
    report = packetiser.report(2_000_000_000, 1_500_000_000)
    fields = [int.from_bytes(report[at : at + 4], "big") for at in range(0, 28, 4)]
    assert fields[0] == 0x80C80006
    assert fields[1:3] == [9, 2_208_988_801]
    assert fields[3] == 1 << 31
    assert fields[4:] == [180_000, len(sent), sum(len(packet) - 12 for packet in sent)]
    assert report[28:32] == b"\x81\xca\x00\x04"
    assert len(report) % 4 == 0


def test_the_description_has_the_parameter_sets():
    text = session_description(
        b"\0\0\0\1\x67\x64\0\x1f\1\0\0\0\1\x68\xce\1\0\0\1\x65\x88", fps=30, host="127.0.0.1"
    )
    assert "profile-level-id=64001f" in text
    sets = text.partition("sprop-parameter-sets=")[2].split("\r\n")[0].split(",")
    assert [base64.b64decode(each)[0] for each in sets] == [0x67, 0x68]


def test_a_keyframe_without_parameter_sets_is_refused():
    with pytest.raises(ValueError, match="parameter sets"):
        session_description(b"\0\0\0\1\x65\x88", fps=30, host="127.0.0.1")
