"""Units of a stream, as every source yields them, and word of what it waits for."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class StreamFormat:
    """How the units of one connection are coded; another connection has another one.

    Attributes:
        codec: FFmpeg's name of it: "h264", "hevc", "mjpeg", "rawvideo".
        header: what a decoder needs first: parameter sets in Annex B for H.264 and HEVC.
        width_px: picture width where only the container knows it (raw pictures), else 0.
        height_px: likewise.
        pixels: FFmpeg's name of the pixel format of raw pictures, else empty.
    """

    codec: str
    header: bytes = b""
    width_px: int = 0
    height_px: int = 0
    pixels: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Unit:
    """One encoded picture as it arrived.

    Attributes:
        format: how it is coded.
        data: one access unit; Annex B for H.264 and HEVC, with parameter sets at keyframes.
        keyframe: whether decoding may start here.
        pts_ns: the camera's own time of it, from any origin; None where the stream has none.
        track: which picture track of a source that sends one a lens.
    """

    format: StreamFormat
    data: bytes
    keyframe: bool
    pts_ns: int | None
    track: int = 0


@dataclass(frozen=True, slots=True)
class Idle:
    """Nothing arrived for a moment.

    Attributes:
        text: what the source waits for, in words.
        connected: whether a camera is there.
    """

    text: str
    connected: bool


class SourceError(ValueError):
    """A stream that ended or cannot be received.

    Args:
        text: what happened, and what to do.
        is_final: whether trying again by itself is of no use.
    """

    def __init__(self, text: str, *, is_final: bool = False) -> None:
        super().__init__(text)
        self.is_final = is_final


class StreamEndedError(SourceError):
    """A recording that was played to its end: nothing is wrong and nothing more will come."""


IDLE_S = 0.1
"""Longest a source may be silent, seconds: how soon a close is seen and a late picture noticed."""


class Source(Protocol):
    """Source of units. One thread calls `units` and takes what it yields."""

    tracks: int
    """Picture tracks of which one unit each make a picture of the camera."""

    def units(self, stop: threading.Event) -> Iterator[Unit | Idle]:
        """Units of one connection, in order; `Idle` at least every `IDLE_S`.

        Ends when `stop` is set or the camera ends the stream.

        Raises:
            SourceError: it broke off or cannot be received.
        """
        ...

    def close(self) -> None:
        """Give back sockets and processes. No thread is in `units`."""
        ...
