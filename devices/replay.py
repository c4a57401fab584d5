"""A recording as a camera: the frames that were recorded, decoded again from their packets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.adapter import DeviceStatus, IteratorDevice, Sink
from devices.camera.lenses.lens_pictures import lens_pictures
from devices.camera.stream_decoder import StreamDecoder
from devices.camera.stream_picture import StreamPicture
from devices.camera.units import StreamFormat, Unit
from devices.clock import Clock
from devices.messages import EncodedFrame, Frame
from devices.recording import read_recording, read_session
from devices.recording_codec import FrameStamp, RecordedValue
from devices.session_info import LiveStream, SessionInfo
from devices.video import H264Decoder, split_lenses


class FrameAssembler:
    """Puts recorded packets and stamps together again, in the order of the recording.

    Args:
        session: how it was recorded.
    """

    def __init__(self, session: SessionInfo) -> None:
        self._rig = session.rig
        self._live = None if session.stream is None else _LivePackets(session.stream)
        self._decoders: dict[str, H264Decoder] = {}
        self._stamps: dict[str, FrameStamp] = {}

    def feed(self, value: RecordedValue) -> Frame | None:
        """Take the next value; returns a frame when the value completes one.

        Raises:
            ValueError: a packet cannot be decoded or does not suit the rig.
        """
        if isinstance(value, FrameStamp):
            self._stamps[value.stream_id] = value
        if not isinstance(value, EncodedFrame):
            return None
        stamp = self._stamps.get(value.stream_id.partition("/")[0])
        is_wanted = stamp is not None and stamp.seq == value.seq
        if self._live is not None:
            images = self._live.images(value, is_wanted=is_wanted)
        else:
            picture = self._decoders.setdefault(value.stream_id, H264Decoder()).decode(value)
            images = None if picture is None else split_lenses(picture, len(self._rig.lenses))
        if images is None or stamp is None or not is_wanted:
            return None
        return Frame(
            stream_id=stamp.stream_id,
            seq=stamp.seq,
            t_ns=value.t_ns,
            received_ns=stamp.received_ns,
            images=images,
            rig=self._rig,
            world_from_rig=stamp.world_from_rig,
        )


class _LivePackets:
    """Decodes a live camera's packets as its receiver did."""

    def __init__(self, stream: LiveStream) -> None:
        self._stream = stream
        self._decoder = StreamDecoder(stream.tracks)
        self._formats: dict[int, StreamFormat] = {}

    def images(
        self, packet: EncodedFrame, *, is_wanted: bool
    ) -> tuple[NDArray[np.uint8], ...] | None:
        """Lens pictures of the moment that a packet completes; None unless it is wanted."""
        track = int(packet.stream_id.partition("/")[2] or 0)
        if packet.begins or track not in self._formats:
            self._formats[track] = StreamFormat(packet.codec)
        unit = Unit(self._formats[track], packet.data, packet.keyframe, None, track)
        decoded = self._decoder.decode(unit, packet.seq)
        if decoded is None or not is_wanted:
            return None
        return stream_images(decoded.pictures, self._stream)


def stream_images(
    pictures: Sequence[StreamPicture], stream: LiveStream
) -> tuple[NDArray[np.uint8], ...]:
    """Upright lens pictures of what a live camera showed, as `Frame.images` holds them.

    Args:
        pictures: one for all lenses, or one a track.
        stream: how they hold the lenses; of several tracks, how each of them does.
    """
    size = stream.lens_size_px
    made = [lens_pictures(picture, stream.layout, lens_size_px=size) for picture in pictures]
    return tuple(image for images in made for image in images)


class ReplayCamera:
    """A `Device` that plays the camera frames of a recording.

    Args:
        path: an MCAP recording.

    Raises:
        RecordingError: it is not a whole recording of ours.
        OSError: it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.session = read_session(path)
        self._path = path
        self._device = IteratorDevice(f"replay {path.name}", self.frames)

    def frames(self) -> Iterator[Frame]:
        """All frames in order, on the caller's thread: exact replay.

        Raises:
            RecordingError: the recording is damaged.
            ValueError: a packet cannot be decoded.
        """
        assembler = FrameAssembler(self.session)
        for value in read_recording(self._path):
            frame = assembler.feed(value)
            if frame is not None:
                yield frame

    def start(self, sink: Sink[Frame], clock: Clock) -> None:
        """See `Device.start`: paced replay."""
        self._device.start(sink, clock)

    def stop(self) -> None:
        """See `Device.stop`."""
        self._device.stop()

    def status(self) -> DeviceStatus:
        """See `Device.status`."""
        return self._device.status()
