"""Voice in bytes: there and back, cut at every byte, and what is no Opus."""

import numpy as np
import pytest

from devices.hub.media.voice_wire import (
    MAX_OPUS_BYTES,
    Voice,
    decode_voice,
    encode_voice,
    opus_samples,
    pack_voices,
    unpack_voices,
)
from devices.hub.protocol.wire import WireError

OPUS = bytes([0b01111_0_00]) + bytes(40)  # hybrid, 20 ms, one frame
VOICE = Voice(65535, 4_000_000_000, 20, OPUS)


def test_a_voice_goes_there_and_back():
    assert decode_voice(encode_voice(VOICE)) == VOICE
    assert len(encode_voice(VOICE)) == 9 + len(OPUS)
    both = ((1, VOICE), (65535, Voice(0, 0, 127, OPUS[:5])))
    assert unpack_voices(pack_voices(both)) == both


@pytest.mark.parametrize(
    ("opus", "samples"),
    [
        (bytes([0 << 3]), 480),  # SILK, 10 ms
        (bytes([3 << 3]), 2880),  # SILK, 60 ms
        (bytes([15 << 3]), 960),  # hybrid, 20 ms
        (bytes([16 << 3]), 120),  # CELT, 2.5 ms
        (bytes([31 << 3 | 1]), 1920),  # CELT, two frames of 20 ms
        (bytes([31 << 3 | 3, 3]), 2880),  # CELT, three frames
    ],
)
def test_the_length_of_opus_is_read_from_its_head(opus, samples):
    assert opus_samples(opus) == samples


@pytest.mark.parametrize(
    "opus",
    [b"", bytes(MAX_OPUS_BYTES + 1), bytes([3]), bytes([3, 0]), bytes([3 << 3 | 1]), b"\xff\x3f"],
)
def test_what_is_no_opus_is_refused(opus):
    with pytest.raises(WireError):
        opus_samples(opus)


def test_cut_long_and_changed_bytes_are_refused():
    data, several = encode_voice(VOICE), pack_voices([(1, VOICE), (2, VOICE)])
    for end in range(10):
        with pytest.raises(WireError):
            decode_voice(data[:end])
    for end in range(len(several)):
        with pytest.raises(WireError):
            unpack_voices(several[:end])
    for wrong in (b"\2" + data[1:], data[:1] + b"\1" + data[2:], data + bytes(500)):
        with pytest.raises(WireError):
            decode_voice(wrong)
    with pytest.raises(WireError, match="level"):
        encode_voice(Voice(1, 1, 128, OPUS))
    with pytest.raises(WireError):
        encode_voice(Voice(1 << 16, 1, 1, OPUS))
    with pytest.raises(WireError):
        unpack_voices(several + b"\0")


def test_random_bytes_are_refused_or_read():
    random = np.random.default_rng(5)
    for _ in range(5000):
        data = bytes([1, int(random.integers(5, 7))]) + random.bytes(int(random.integers(0, 80)))
        for read in (decode_voice, unpack_voices):
            try:
                read(data)
            except WireError:
                continue
