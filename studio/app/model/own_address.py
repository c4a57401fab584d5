"""The address of this computer as a camera in its network reaches it."""

from __future__ import annotations

import socket

ANYWHERE = "THIS-COMPUTER"
"""Host in the address of a listener on all interfaces."""

OUTSIDE = ("192.0.2.1", 9)
"""An address that nobody has (RFC 5737): only the way to it is asked for, and nothing is sent."""


def own_address() -> str:
    """IPv4 address of the interface that leads outside; the computer's name where none does."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(OUTSIDE)
            return str(probe.getsockname()[0])
    except OSError:
        return socket.gethostname()


def reachable(listening_at: str) -> str:
    """A listener's address with this computer's own in it."""
    if ANYWHERE not in listening_at:
        return listening_at
    return listening_at.replace(ANYWHERE, own_address())
