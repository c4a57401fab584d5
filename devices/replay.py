"""A recording as a camera: the frames that were recorded, decoded again from their packets."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from devices.adapter import DeviceStatus, IteratorDevice, Sink
from devices.clock import Clock
from devices.messages import EncodedFrame, Frame
from devices.packet_pictures import PacketPictures
from devices.recording import read_recording, read_session
from devices.recording_codec import FrameStamp, RecordedValue
from devices.session_info import SessionInfo


class FrameAssembler:
    """Puts recorded packets and stamps together again, in the order of the recording.

    Args:
        session: how it was recorded.
    """

    def __init__(self, session: SessionInfo) -> None:
        self._rig = session.rig
        self._pictures = PacketPictures(session)
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
        images = self._pictures.lenses(value, is_wanted=is_wanted)
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
