"""How long the preview client waits, and what it counts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PreviewLimits:
    """How long the client waits, in seconds.

    Attributes:
        connect_s: for the connection and the sync words.
        reply_s: for a reply to a command.
        packet_s: for the rest of a packet that has begun.
        picture_s: for the next picture while the preview runs.
    """

    connect_s: float = 5.0
    reply_s: float = 5.0
    packet_s: float = 5.0
    picture_s: float = 5.0


@dataclass(frozen=True, slots=True)
class PreviewCounts:
    """Counts of what came so far.

    Attributes:
        packets, bytes: of all kinds.
        units: pictures.
        dropped: pictures that nobody took in time.
        skipped: packets of a kind that is not known, and gyro or clock packets.
    """

    packets: int = 0
    bytes: int = 0
    units: int = 0
    dropped: int = 0
    skipped: int = 0
