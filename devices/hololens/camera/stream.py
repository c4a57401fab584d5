"""Personal video of one connection: packets in, decoded pictures with what is said of them out."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from devices.camera.decoding import Arrived, Decoding
from devices.camera.received import Received
from devices.camera.stream_decoder import StreamPicture
from devices.camera.units import StreamFormat, Unit
from devices.clock import Clock
from devices.hololens.wire.packets import Packet
from devices.hololens.wire.personal_video import (
    DEFAULT_LEVEL,
    GROUP_OPTION,
    Profile,
    VideoRequest,
    VideoTrailer,
    default_bitrate,
    read_payload,
)
from devices.hololens.wire.video_formats import read_raw

PROFILES = {"h264": Profile.H264_MAIN, "hevc": Profile.HEVC_MAIN, "raw": Profile.RAW}
"""Profile that is asked for, by the name of its codec."""

MAX_KEPT = 128
"""Pictures whose trailers are kept while they are decoded: 4 s of them."""

START_CODE = b"\x00\x00\x01"
"""Begin of each part of an H.264 or HEVC picture."""


def video_request(width_px: int, height_px: int, *, fps: int, codec: str) -> VideoRequest:
    """Return a request for a stream with poses and a keyframe a second.

    Raises:
        ValueError: the codec is none of `PROFILES`.
    """
    profile = PROFILES.get(codec)
    if profile is None:
        raise ValueError(f"codec {codec!r}: wanted one of {', '.join(PROFILES)}")
    bitrate = default_bitrate(width_px, height_px, fps=fps, profile=profile)
    options = ((GROUP_OPTION, fps),)
    return VideoRequest(True, width_px, height_px, fps, 1, profile, DEFAULT_LEVEL, bitrate, options)


def is_keyframe(codec: str, data: bytes) -> bool:
    """Whether decoding may start at an access unit in Annex B."""
    at = data.find(START_CODE)
    while 0 <= at < len(data) - 3:
        head = data[at + 3]
        if codec == "h264":
            kind = head & 31
            if kind in (5, 7):
                return True
            if kind == 1:
                return False
        else:
            kind = head >> 1 & 63
            if 16 <= kind <= 21 or kind in (32, 33):
                return True
            if kind < 16:
                return False
        at = data.find(START_CODE, at + 3)
    return False


@dataclass(frozen=True, slots=True, eq=False)
class DecodedVideo:
    """One picture, in the headset's own time and axes.

    Attributes:
        seq: counts encoded pictures from 0.
        packet: what it came in, without the picture.
        arrived_ns: when its last byte came, session time.
        trailer: what is said of it.
        picture: its planes.
    """

    seq: int
    packet: Packet
    arrived_ns: int
    trailer: VideoTrailer
    picture: StreamPicture


class VideoStream:
    """Decodes personal video on a thread of its own; starts at once.

    A picture that a newer one has overtaken is not decoded where a keyframe allows that.

    Args:
        codec: of the pictures: one of `PROFILES`.
        clock: session time.
        hand_out: takes each picture, on the thread that decodes.
    """

    def __init__(
        self, codec: str, clock: Clock, *, hand_out: Callable[[DecodedVideo], None]
    ) -> None:
        self._codec, self._clock, self._hand_out = codec, clock, hand_out
        self._lock = threading.Lock()
        self._about: deque[tuple[int, Packet, int, VideoTrailer]] = deque(maxlen=MAX_KEPT)
        self._seq = 0
        self._form = StreamFormat("")
        self._decoding = self._start()

    @property
    def damaged(self) -> int:
        """Pictures that could not be decoded."""
        return self._decoding.damaged

    @property
    def skipped(self) -> int:
        """Pictures that were not decoded, since a newer one was there already."""
        return self._decoding.skipped

    def begin(self) -> None:
        """Another connection begins: its first picture refers to none before."""
        self._form = StreamFormat("")

    def put(self, packet: Packet, arrived_ns: int) -> None:
        """Take a packet; never waits.

        Raises:
            WireError: it is no picture.
            SourceError: the pictures are too large.
        """
        data, trailer = read_payload(packet.payload)
        if self._codec == "raw":
            nv12 = read_raw(data, trailer.width_px, height_px=trailer.height_px)
            if (self._form.width_px, self._form.height_px) != (trailer.width_px, trailer.height_px):
                size = trailer.width_px, trailer.height_px
                self._form = StreamFormat("rawvideo", b"", *size, pixels="nv12")
            unit = Unit(self._form, nv12.tobytes(), True, packet.ticks)
        else:
            if not self._form.codec:
                self._form = StreamFormat(self._codec)
            unit = Unit(self._form, data, is_keyframe(self._codec, data), packet.ticks)
        bare = Packet(packet.ticks, b"", packet.pose)
        with self._lock:
            self._about.append((self._seq, bare, arrived_ns, trailer))
        self._decoding.put(Arrived(unit, self._seq, arrived_ns))
        self._seq += 1

    def close(self) -> None:
        """End after the picture that is being decoded, and wait for it."""
        self._decoding.close()

    def _start(self) -> Decoding:
        return Decoding(1, clock=self._clock, name="hololens decodes", hand_out=self._give)

    def _give(self, received: Received) -> None:
        with self._lock:
            about = next((each for each in self._about if each[0] == received.seq), None)
        if about is not None:
            seq, packet, arrived_ns, trailer = about
            self._hand_out(DecodedVideo(seq, packet, arrived_ns, trailer, received.pictures[0]))
