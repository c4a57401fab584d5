"""Messages between adapters and stages. All are immutable; times are session nanoseconds."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Rig
from scenes.pose import Pose


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture of a 360° camera: one RGB image per lens.

    Attributes:
        stream_id: which camera.
        seq: counts frames of the stream from 0; gaps are drops.
        t_ns: capture time on the session clock.
        received_ns: when it reached us on the session clock.
        images: one (H, W, 3) uint8 RGB per lens of `rig`.
        rig: lenses and their mounting.
        world_from_rig: pose of the camera as the session knows it (a marker's estimate), or None.
    """

    stream_id: str
    seq: int
    t_ns: int
    received_ns: int
    images: tuple[NDArray[np.uint8], ...]
    rig: Rig
    world_from_rig: Pose | None


@dataclass(frozen=True, slots=True, eq=False)
class EncodedFrame:
    """A compressed video packet exactly as it left the encoder.

    Attributes:
        stream_id: which camera.
        seq: frame counter.
        t_ns: capture time.
        data: one access unit; Annex B for H.264 and HEVC.
        keyframe: whether decoding may start here.
        codec: FFmpeg's name of how it is coded.
        begins: whether it is the first of a connection: the decoder starts anew.
    """

    stream_id: str
    seq: int
    t_ns: int
    data: bytes
    keyframe: bool
    codec: str = "h264"
    begins: bool = False


@dataclass(frozen=True, slots=True)
class VoicePacket:
    """A moment of somebody's voice, recorded where the operator has said so.

    Attributes:
        t_ns: of the frame with which it entered the session.
        heard_ns: when it was heard.
        user_id: whose it is.
        seq: counts their moments, of 16 bits.
        time: samples of 48 kHz since some instant of theirs, of 32 bits.
        opus: one packet of Opus.
    """

    t_ns: int
    heard_ns: int
    user_id: str
    seq: int
    time: int
    opus: bytes

    def fields(self) -> dict[str, Any]:
        """Return all but its time and number, as a recording has them."""
        opus = base64.b64encode(self.opus).decode("ascii")
        return {
            "user_id": self.user_id,
            "heard_ns": self.heard_ns,
            "time": self.time,
            "opus": opus,
        }

    @staticmethod
    def from_fields(fields: Mapping[str, Any], *, t_ns: int, seq: int) -> VoicePacket:
        """Return the moment that a recording has.

        Raises:
            ValueError, KeyError, TypeError: the fields are not what `fields` returns.
        """
        opus = base64.b64decode(fields["opus"], validate=True)
        heard_ns, time = int(fields["heard_ns"]), int(fields["time"])
        return VoicePacket(t_ns, heard_ns, str(fields["user_id"]), seq, time, opus)


@dataclass(frozen=True, slots=True)
class Event:
    """An event of the session: when it happened, to whom, which kind, and in words."""

    t_ns: int
    source: str
    kind: str
    text: str
