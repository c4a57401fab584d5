"""Recorded video packets to lens pictures: the simulator's, or as a live camera sent them."""

from __future__ import annotations

from devices.camera.lenses.lens_pictures import LensPictures, stream_images
from devices.camera.stream_decoder import StreamDecoder
from devices.camera.units import StreamFormat, Unit
from devices.messages import EncodedFrame
from devices.session_info import LiveStream, SessionInfo
from devices.video import H264Decoder, split_lenses


class PacketPictures:
    """Decodes the packets of one recording, in their order from a keyframe on.

    Args:
        session: how it was recorded.
    """

    def __init__(self, session: SessionInfo) -> None:
        self._lenses = len(session.rig.lenses)
        self._stream = session.stream
        self._simulated = H264Decoder()
        self._live = StreamDecoder(1 if session.stream is None else session.stream.tracks)
        self._formats: dict[int, StreamFormat] = {}

    def lenses(self, packet: EncodedFrame, *, is_wanted: bool) -> LensPictures | None:
        """One upright picture a lens, once a packet completes them; None unless they are wanted.

        Raises:
            ValueError: the packet cannot be decoded, or does not suit the session's lenses.
        """
        if self._stream is not None:
            return self._of_stream(packet, self._stream, is_wanted=is_wanted)
        if not is_wanted:
            self._simulated.skip(packet)
            return None
        picture = self._simulated.decode(packet)
        return None if picture is None else split_lenses(picture, self._lenses)

    def _of_stream(
        self, packet: EncodedFrame, stream: LiveStream, *, is_wanted: bool
    ) -> LensPictures | None:
        track = int(packet.stream_id.partition("/")[2] or 0)
        if packet.begins or track not in self._formats:
            self._formats[track] = StreamFormat(packet.codec)
        unit = Unit(self._formats[track], packet.data, packet.keyframe, None, track)
        decoded = self._live.decode(unit, packet.seq)
        if decoded is None or not is_wanted:
            return None
        return stream_images(decoded.pictures, stream)
