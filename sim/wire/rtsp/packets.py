"""RTP packets of H.264 access units (RFC 6184, mode 1), and the sender's reports (RFC 3550)."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence

from sim.wire.flv_packets import DELIMITER, PPS, SPS, nal_units

CLOCK_HZ = 90_000
"""Ticks a second of the time stamps (RFC 6184, section 5.1)."""

PAYLOAD_TYPE = 96
"""Number of the payload's format; the first of those that are given away freely."""

MAX_BYTES = 1400
"""Largest packet without IP and UDP headers: what fits Ethernet's 1500 with a tunnel around it."""

HEADER_BYTES = 12
"""Of an RTP packet without extensions."""

STAP_A, FU_A = 24, 28
"""Types of a packet of several units, and of a part of one (RFC 6184, table 1)."""

NTP_FROM_UNIX_S = 2_208_988_800
"""Seconds from 1900, where NTP's time begins, to 1970."""


class Packetiser:
    """One stream of packets, numbered.

    Args:
        ssrc: the stream's number, 32 bits.
        first_number: of its first packet, 16 bits.
        first_tick: time stamp of time 0, 32 bits.
    """

    def __init__(self, ssrc: int, first_number: int, first_tick: int) -> None:
        self._ssrc = ssrc & 0xFFFFFFFF
        self._number = first_number & 0xFFFF
        self._first_tick = first_tick
        self.packets = 0
        """Packets so far."""
        self.payload_bytes = 0
        """Bytes so far without headers."""

    def packets_of(self, annex_b: bytes, t_ns: int) -> Iterator[bytes]:
        """The packets of one access unit; the last one is marked."""
        units = [unit for unit in nal_units(annex_b) if unit[0] & 31 != DELIMITER]
        payloads = list(_payloads(units))
        tick = self.tick(t_ns)
        for position, payload in enumerate(payloads):
            is_last = position == len(payloads) - 1
            header = (
                bytes([0x80, PAYLOAD_TYPE | (0x80 if is_last else 0)])
                + self._number.to_bytes(2, "big")
                + tick.to_bytes(4, "big")
                + self._ssrc.to_bytes(4, "big")
            )
            self._number = self._number + 1 & 0xFFFF
            self.packets += 1
            self.payload_bytes += len(payload)
            yield header + payload

    def tick(self, t_ns: int) -> int:
        """A time as the packets have it."""
        return self._first_tick + t_ns * CLOCK_HZ // 1_000_000_000 & 0xFFFFFFFF

    def report(self, t_ns: int, wall_ns: int) -> bytes:
        """Report on the stream: the clock time of one of its times, and how much was sent.

        Args:
            t_ns: a time of the stream.
            wall_ns: the same, nanoseconds since 1970.
        """
        seconds, rest = divmod(wall_ns, 1_000_000_000)
        sender = (
            self._ssrc.to_bytes(4, "big")
            + (seconds + NTP_FROM_UNIX_S & 0xFFFFFFFF).to_bytes(4, "big")
            + (rest * (1 << 32) // 1_000_000_000).to_bytes(4, "big")
            + self.tick(t_ns).to_bytes(4, "big")
            + (self.packets & 0xFFFFFFFF).to_bytes(4, "big")
            + (self.payload_bytes & 0xFFFFFFFF).to_bytes(4, "big")
        )
        name = b"\x01\x06camera"
        items = self._ssrc.to_bytes(4, "big") + name + bytes(4 - len(name) % 4)
        return _rtcp(200, 0, sender) + _rtcp(202, 1, items)

    def goodbye(self) -> bytes:
        """That the stream is over."""
        return _rtcp(203, 1, self._ssrc.to_bytes(4, "big"))


def parameter_sets(annex_b: bytes) -> tuple[bytes, bytes]:
    """The first SPS and PPS of a keyframe.

    Raises:
        ValueError: it has none.
    """
    units = nal_units(annex_b)
    sps = next((unit for unit in units if unit[0] & 31 == SPS), None)
    pps = next((unit for unit in units if unit[0] & 31 == PPS), None)
    if sps is None or pps is None or len(sps) < 4:
        raise ValueError("H.264 keyframe without parameter sets: the encoder must repeat them")
    return sps, pps


def session_description(keyframe: bytes, *, fps: float, host: str) -> str:
    """Describe the stream to a player before it asks for packets (SDP, RFC 4566 and RFC 6184).

    Args:
        keyframe: one of the stream, for its parameter sets.
        fps: nominal pictures a second.
        host: address of the server.
    """
    sps, pps = parameter_sets(keyframe)
    sets = ",".join(base64.b64encode(each).decode("ascii") for each in (sps, pps))
    family = "IP6" if ":" in host else "IP4"
    lines = (
        "v=0",
        f"o=- 1 1 IN {family} {host}",
        "s=simulated 360 degree camera",
        f"c=IN {family} {'::' if family == 'IP6' else '0.0.0.0'}",
        "t=0 0",
        "a=control:*",
        "a=range:npt=now-",
        f"m=video 0 RTP/AVP {PAYLOAD_TYPE}",
        f"a=rtpmap:{PAYLOAD_TYPE} H264/{CLOCK_HZ}",
        f"a=fmtp:{PAYLOAD_TYPE} packetization-mode=1;profile-level-id={sps[1:4].hex()};"
        f"sprop-parameter-sets={sets}",
        f"a=framerate:{fps:g}",
        "a=control:trackID=0",
    )
    return "\r\n".join([*lines, ""])


def _payloads(units: Sequence[bytes]) -> Iterator[bytes]:
    """Small units that follow one another in one packet, large ones in several."""
    max_bytes = MAX_BYTES - HEADER_BYTES
    together: list[bytes] = []
    for unit in units:
        if len(unit) > max_bytes:
            yield from _aggregated(together)
            together = []
            yield from _parts(unit, max_bytes)
            continue
        if 1 + sum(2 + len(each) for each in (*together, unit)) > max_bytes:
            yield from _aggregated(together)
            together = []
        together.append(unit)
    yield from _aggregated(together)


def _aggregated(units: Sequence[bytes]) -> Iterator[bytes]:
    if len(units) == 1:
        yield units[0]
    elif units:
        importance = max(unit[0] & 0x60 for unit in units)
        yield bytes([importance | STAP_A]) + b"".join(
            len(unit).to_bytes(2, "big") + unit for unit in units
        )


def _parts(unit: bytes, max_bytes: int) -> Iterator[bytes]:
    indicator, kind = unit[0] & 0xE0 | FU_A, unit[0] & 31
    size = max_bytes - 2
    for at in range(1, len(unit), size):
        begins, ends = at == 1, at + size >= len(unit)
        header = kind | (0x80 if begins else 0) | (0x40 if ends else 0)
        yield bytes([indicator, header]) + unit[at : at + size]


def _rtcp(kind: int, count: int, body: bytes) -> bytes:
    return bytes([0x80 | count, kind]) + (len(body) // 4).to_bytes(2, "big") + body
