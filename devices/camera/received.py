"""Output of a camera's receiver: pictures with the time they arrived, and its status."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from devices.camera.stream_decoder import StreamPicture


class CameraState(StrEnum):
    """How a camera's stream is doing.

    `CONNECTING` until the first answer, `LIVE` while pictures come, `HELD` when they stopped and
    the last one is still shown, `WAITING` when there is none to show and a camera is awaited or
    tried again, `FAILED` when only a person can help, `ENDED` after the last picture of a file.
    """

    CONNECTING = "connecting"
    LIVE = "live"
    HELD = "held"
    WAITING = "waiting"
    FAILED = "failed"
    ENDED = "ended"


@dataclass(frozen=True, slots=True, eq=False)
class Received:
    """One picture of the camera.

    Attributes:
        seq: counts encoded pictures of the receiver from 0; gaps are drops.
        t_ns: when its last byte arrived, on the session clock.
        decoded_ns: when it was decoded.
        pts_ns: the camera's own time of it, from any origin; None where the stream has none.
        pictures: one for all lenses, or one a lens where the camera sends a track a lens.
    """

    seq: int
    t_ns: int
    decoded_ns: int
    pts_ns: int | None
    pictures: tuple[StreamPicture, ...]


@dataclass(frozen=True, slots=True)
class CameraStatus:
    """How a receiver is doing at one moment.

    Attributes:
        state: in one word.
        reason: why, in a sentence.
        size_px: width and height of the last picture, (0, 0) before the first.
        codec: FFmpeg's name of the codec, empty before the first picture.
        last_age_ns: time since the last picture arrived; None before the first.
        pictures: decoded so far.
        dropped: replaced by a newer one before anybody took them, or before they were decoded.
        damaged: encoded pictures that could not be decoded.
        unsaved: encoded pictures that the packet sink had no room for.
        received_bytes: encoded bytes so far.
        connections: how often a stream began.
    """

    state: CameraState
    reason: str
    size_px: tuple[int, int] = (0, 0)
    codec: str = ""
    last_age_ns: int | None = None
    pictures: int = 0
    dropped: int = 0
    damaged: int = 0
    unsaved: int = 0
    received_bytes: int = 0
    connections: int = 0
