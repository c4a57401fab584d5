import cv2
import numpy as np
import pytest

from devices.messages import EncodedFrame
from devices.video import (
    KEYFRAME_S,
    H264Decoder,
    H264Encoder,
    side_by_side,
    split_lenses,
)

WIDTH, HEIGHT, FPS = 256, 128, 10


def moving_pictures(count, seed=3):
    rng = np.random.default_rng(seed)
    noise = rng.integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    smooth = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 6), None, 0, 255, cv2.NORM_MINMAX)
    return [np.roll(smooth, 3 * i, axis=1) for i in range(count)]


def encode_all(pictures, **options):
    encoder = H264Encoder(WIDTH, HEIGHT, FPS, 1_500_000, **options)
    return [encoder.encode(p, i, i * 100_000_000) for i, p in enumerate(pictures)]


def test_one_picture_in_gives_one_packet_out_and_one_picture_back():
    pictures = moving_pictures(25)
    decoder = H264Decoder()
    for seq, (picture, packets) in enumerate(zip(pictures, encode_all(pictures), strict=True)):
        assert len(packets) == 1
        assert (packets[0].seq, packets[0].t_ns) == (seq, seq * 100_000_000)
        assert packets[0].keyframe == (seq % round(KEYFRAME_S * FPS) == 0)
        decoded = decoder.decode(packets[0])
        assert decoded is not None
        error = decoded.astype(float) - picture
        assert 10 * np.log10(255**2 / np.mean(error**2)) > 32


@pytest.mark.parametrize("colour", [(255, 0, 0), (0, 160, 80), (20, 40, 200), (255, 255, 255)])
def test_colours_survive(colour):
    picture = np.full((HEIGHT, WIDTH, 3), colour, dtype=np.uint8)
    decoded = H264Decoder().decode(encode_all([picture])[0][0])
    assert np.abs(decoded[8:-8, 8:-8].astype(int) - colour).max() <= 4


def test_the_same_pictures_give_the_same_bytes():
    pictures = moving_pictures(8)
    first, second = ([p.data for ps in encode_all(pictures) for p in ps] for _repeat in range(2))
    assert first == second


def test_decoding_starts_at_a_keyframe():
    packets = [p for ps in encode_all(moving_pictures(6), keyframe_interval=4) for p in ps]
    decoder = H264Decoder()
    assert [decoder.decode(p) is not None for p in packets[1:]] == [False] * 3 + [True, True]


def test_garbage_names_stream_and_frame():
    with pytest.raises(ValueError, match="cam frame 7: 60 bytes are not a whole H"):
        H264Decoder().decode(EncodedFrame("cam", 7, 0, b"garbage!!!" * 6, True))


@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9])
def test_a_cut_off_packet_gives_no_picture(kept):
    packet = encode_all(moving_pictures(1))[0][0]
    cut = packet.data[: int(kept * len(packet.data))]
    assert H264Decoder().decode(EncodedFrame("cam", 0, 0, cut, True)) is None


def test_wrong_sizes_are_refused():
    with pytest.raises(ValueError, match="even numbers"):
        H264Encoder(255, 128, 10, 1000)
    with pytest.raises(ValueError, match="both > 0"):
        H264Encoder(256, 128, 0, 1000)
    encoder = H264Encoder(WIDTH, HEIGHT, FPS, 1000)
    with pytest.raises(ValueError, match="frame 3: picture"):
        encoder.encode(np.zeros((HEIGHT, HEIGHT, 3), np.uint8), 3, 0)


def test_lenses_side_by_side_come_apart_again():
    lenses = (np.zeros((4, 4, 3), np.uint8), np.full((4, 4, 3), 9, np.uint8))
    assert all(
        np.array_equal(a, b)
        for a, b in zip(lenses, split_lenses(side_by_side(lenses), 2), strict=True)
    )
    with pytest.raises(ValueError, match="8 px wide: cannot be shared by 3"):
        split_lenses(side_by_side(lenses), 3)


def test_a_group_can_begin_at_any_picture():
    encoder = H264Encoder(WIDTH, HEIGHT, FPS, 1_000_000, keyframe_interval=4)
    kinds = []
    for seq, picture in enumerate(moving_pictures(10)):
        if seq == 6:
            encoder.begin_group()
        kinds.append(encoder.encode(picture, seq, seq * 100_000_000)[0].keyframe)
    assert [seq for seq, keyframe in enumerate(kinds) if keyframe] == [0, 4, 6]
