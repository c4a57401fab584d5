"""How a player wants to have the packets: the `Transport` header (RFC 2326, section 12.39)."""

from __future__ import annotations

import re
from dataclasses import dataclass

MAX_OFFERS = 16
"""Transports that are looked at in one header; players offer one or two."""


@dataclass(frozen=True, slots=True)
class OverTcp:
    """Between the replies on the connection itself.

    Attributes:
        rtp: channel of the pictures.
        rtcp: of the reports.
    """

    rtp: int
    rtcp: int

    @property
    def header(self) -> str:
        """As the reply names it."""
        return f"RTP/AVP/TCP;unicast;interleaved={self.rtp}-{self.rtcp}"


@dataclass(frozen=True, slots=True)
class OverUdp:
    """To the player's own ports, on the host it is connected from and no other.

    Attributes:
        rtp: port of the pictures.
        rtcp: of the reports.
    """

    rtp: int
    rtcp: int

    @property
    def header(self) -> str:
        """As the reply names it, but for the server's ports."""
        return f"RTP/AVP;unicast;client_port={self.rtp}-{self.rtcp}"


def read_transport(text: str) -> OverTcp | OverUdp | None:
    """The first of the offered transports that can be served; None if none can.

    A destination that is asked for is ignored: packets go to whoever asks.
    """
    for offer in text.split(",")[:MAX_OFFERS]:
        words = [word.strip() for word in offer.split(";")]
        if "multicast" in words:
            continue
        if words[0].upper() == "RTP/AVP/TCP":
            pair = _pair(words, "interleaved", 255) or (0, 1)
            return OverTcp(*pair)
        if words[0].upper() in ("RTP/AVP", "RTP/AVP/UDP"):
            pair = _pair(words, "client_port", 65535)
            if pair is not None and pair[0] > 0:
                return OverUdp(*pair)
    return None


def _pair(words: list[str], name: str, max_number: int) -> tuple[int, int] | None:
    """Two numbers such as "client_port=5000-5001"; the second follows the first if left out."""
    for word in words:
        found = re.fullmatch(rf"{name}=([0-9]{{1,5}})(?:-([0-9]{{1,5}}))?", word)
        if found is not None:
            first = int(found[1])
            second = first + 1 if found[2] is None else int(found[2])
            return (first, second) if first != second and max(first, second) <= max_number else None
    return None
