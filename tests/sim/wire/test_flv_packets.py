import numpy as np
import pytest

from devices.camera.rtmp.session import FlvVideo
from devices.video import H264Decoder, H264Encoder
from sim.wire.flv_packets import avc_header, avc_picture, nal_units


def encoded(count):
    encoder = H264Encoder(64, 32, 30, 100_000, keyframe_interval=2)
    rng = np.random.default_rng(3)
    for seq in range(count):
        picture = rng.integers(0, 255, (32, 64, 3), dtype=np.uint8)
        yield from encoder.encode(picture, seq, 1 + seq * 33_000_000)


def test_what_is_packed_is_unpacked_and_decoded():
    video, decoder = FlvVideo(), H264Decoder()
    for packet in encoded(4):
        if packet.keyframe:
            assert video.unit(avc_header(packet.data), 0) is None
        unit = video.unit(avc_picture(packet.data, keyframe=packet.keyframe), packet.seq * 33)
        assert unit.keyframe == packet.keyframe
        assert unit.pts_ns == packet.seq * 33_000_000
        wanted = [n for n in nal_units(packet.data) if n[0] & 31 != 9]
        assert nal_units(unit.data) == wanted
        assert decoder.decode(packet) is not None


def test_a_keyframe_without_parameter_sets_is_refused():
    with pytest.raises(ValueError, match="parameter sets"):
        avc_header(b"\x00\x00\x01\x65abc")
