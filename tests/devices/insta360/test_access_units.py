import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.insta360.access_units import MAX_UNIT_BYTES, UnitAssembler
from devices.insta360.errors import CameraProtocolError
from devices.messages import EncodedFrame
from devices.video import H264Decoder, H264Encoder


@pytest.fixture(scope="module")
def frames():
    rng = np.random.default_rng(5)
    picture = rng.integers(0, 256, (64, 128, 3)).astype(np.uint8)
    encoder = H264Encoder(128, 64, 30, 800_000, keyframe_interval=6)
    return [
        frame
        for seq in range(18)
        for frame in encoder.encode(np.roll(picture, 4 * seq, axis=1), seq, seq * 33_000_000)
    ]


def fed(assembler, pieces):
    return [unit for stamp, data in pieces for unit in assembler.feed(stamp, data)]


def test_a_picture_a_packet_is_passed_on_at_once(frames):
    assembler = UnitAssembler()
    for frame in frames:
        (unit,) = assembler.feed(frame.t_ns // 1000, frame.data)
        assert (unit.data, unit.keyframe) == (frame.data, frame.keyframe)
        assert (unit.stamp, unit.codec) == (frame.t_ns // 1000, "h264")
    assert not assembler.split


def test_parameter_sets_in_packets_of_their_own_join_the_keyframe(frames):
    key = frames[0].data
    starts = [at for at in range(len(key)) if key.startswith((b"\0\0\0\1", b"\0\0\1"), at)]
    kinds = {at: key[key.index(b"\1", at) + 1] & 0x1F for at in starts}
    slice_at = next(at for at, kind in kinds.items() if kind == 5)
    assembler = UnitAssembler()
    assert assembler.feed(10, key[:slice_at]) == []
    (unit,) = assembler.feed(10, key[slice_at:])
    assert (unit.data, unit.keyframe, assembler.split) == (key, True, False)


@settings(max_examples=40)
@given(st.data())
def test_pictures_in_pieces_are_whole_from_the_second_keyframe_on(frames, data):
    """The first that goes on was passed on before that was known; what follows is whole."""
    pieces = []
    for frame in frames:
        size = data.draw(st.integers(max(40, len(frame.data) // 4), len(frame.data)))
        cuts = range(0, len(frame.data), size)
        pieces += [(frame.t_ns // 1000, frame.data[at : at + size]) for at in cuts]
    pieces[:1] = [(0, frames[0].data[:50]), (0, frames[0].data[50 : len(pieces[0][1])])]
    units = fed(UnitAssembler(), pieces)
    assert [unit.data for unit in units[1:]] == [frame.data for frame in frames[1:-1]]
    decoder = H264Decoder()
    for seq, unit in enumerate(units[6:]):
        assert (
            decoder.decode(EncodedFrame("c", seq, unit.stamp, unit.data, unit.keyframe)) is not None
        )


def test_nothing_comes_before_the_first_parameter_sets(frames):
    assembler = UnitAssembler()
    assert fed(assembler, [(0, frames[3].data), (1, b""), (2, b"noise")]) == []
    assert assembler.codec is None
    assert len(assembler.feed(3, frames[6].data)) == 1


def test_hevc_is_told_apart():
    vps, slice_idr, slice_next = (
        b"\0\0\0\1\x40\x01\x0c",
        b"\0\0\1\x26\x01\x80a",
        b"\0\0\1\x02\x01\x80b",
    )
    key, after = fed(UnitAssembler(), [(0, vps + slice_idr), (1, slice_next)])
    assert (key.codec, key.keyframe, after.keyframe) == ("hevc", True, False)


def test_a_picture_without_end_is_refused(frames):
    assembler = UnitAssembler()
    assembler.feed(0, frames[0].data)
    assembler.feed(1, frames[1].data[40:])
    assembler.feed(2, frames[2].data)
    endless = [(2, b"\xff" * (1 << 20))] * (MAX_UNIT_BYTES // (1 << 20) + 1)
    with pytest.raises(CameraProtocolError, match="more than 8388608 bytes"):
        fed(assembler, endless)
