"""A live camera's packets give the same lens pictures again, turned and with a new connection."""

from __future__ import annotations

import numpy as np

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import assumed_rig, stream_images
from devices.camera.stream_decoder import StreamDecoder
from devices.camera.units import StreamFormat, Unit
from devices.messages import EncodedFrame
from devices.recording_codec import FrameStamp
from devices.replay import FrameAssembler
from devices.session_info import LiveStream, SessionInfo, session_from_json, session_to_json
from devices.video import H264Encoder
from scenes.pose import Pose

LAYOUT = LensLayout(Arrangement.SIDE_BY_SIDE, (1, 3))
STREAM = LiveStream(LAYOUT, 64)


def session() -> SessionInfo:
    rig = assumed_rig(LAYOUT, STREAM.lens_size_px)
    return SessionInfo("tiny", "", None, "", "", "live", ("own",), {}, rig, 30.0, stream=STREAM)


def packets(count: int, first: int) -> list[EncodedFrame]:
    encoder = H264Encoder(128, 64, 30.0, 400_000, keyframe_interval=4)
    generator = np.random.default_rng(first)
    made: list[EncodedFrame] = []
    for k in range(count):
        picture = np.kron(generator.integers(0, 255, (8, 16, 3), np.uint8), np.ones((8, 8, 1)))
        packet = encoder.encode(picture.astype(np.uint8), first + k, (first + k) * 10)[0]
        made.append(
            EncodedFrame(
                packet.stream_id,
                packet.seq,
                packet.t_ns,
                packet.data,
                packet.keyframe,
                begins=not k,
            )
        )
    return made


def test_what_was_tracked_live_comes_again_to_the_bit():
    # Two connections; of their pictures every third was tracked.
    sent = packets(6, 0) + packets(6, 6)
    decoder, forms = StreamDecoder(1), {}
    live = {}
    for packet in sent:
        if packet.begins:
            forms[0] = StreamFormat("h264")
        unit = Unit(forms[0], packet.data, packet.keyframe, None)
        decoded = decoder.decode(unit, packet.seq)
        assert decoded is not None
        live[packet.seq] = stream_images(decoded.pictures, STREAM)

    again = FrameAssembler(session_from_json(session_to_json(session())))
    found = {}
    for packet in sent:
        if packet.seq % 3 == 0:
            stamp = FrameStamp("camera-360", packet.seq, packet.t_ns, packet.t_ns, Pose.identity())
            assert again.feed(stamp) is None
        frame = again.feed(packet)
        if frame is not None:
            found[frame.seq] = frame.images
    assert sorted(found) == [0, 3, 6, 9]
    for seq, images in found.items():
        for image, before in zip(images, live[seq], strict=True):
            assert image.shape == (64, 64, 3)
            np.testing.assert_array_equal(image, before)


def test_a_session_without_a_stream_reads_as_before():
    text = session_to_json(session()).replace('"mode": "live"', '"mode": "exact"')
    fields = text[: text.index(', "stream"')] + "}"
    assert session_from_json(fields).stream is None
