"""Errors of a camera on the network; each message says what to do about it."""

from __future__ import annotations


class CameraError(ValueError):
    """The camera, or the way to it, failed: names the camera's address and what to do."""


class CameraUnreachableError(CameraError):
    """Nothing answers at the address, or the connection broke."""


class CameraTimeoutError(CameraError):
    """The camera is connected, but did not answer in time."""


class CameraProtocolError(CameraError):
    """The answering device sends bytes that a camera would not send."""


class CameraRefusedError(CameraError):
    """The camera understood, and refused: busy, no card, an option that it does not have."""


def printable(words: str, most: int = 200) -> str:
    """Words of a device, fit for a message: one line, no control characters, not longer."""
    return "".join(c if c.isprintable() else " " for c in words[:most]).strip()
