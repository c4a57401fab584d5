"""HDR film against the same scene in standard range."""

from __future__ import annotations

import av
import numpy as np
import pytest

from scenes.prepare.footage.hdr import HLG, PQ, bgr_picture, hdr_kind, tone_mapped

REC2020_FROM_REC709 = np.array(
    [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]]
)
RGB = np.array([[12, 40, 200], [200, 30, 20], [90, 160, 60], [128, 128, 128], [250, 250, 250]])


def light_of(rgb):
    """Rec. 2020 light, white 1, of sRGB bytes."""
    signal = rgb / 255
    linear = np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)
    return linear @ REC2020_FROM_REC709.T


def as_pq(light):
    y = (203 * light / 10_000) ** 0.1593017578125
    return ((0.8359375 + 18.8515625 * y) / (1 + 18.6875 * y)) ** 78.84375


def as_hlg(light):
    shown = light * 203 / 1000
    luminance = shown @ [0.2627, 0.6780, 0.0593]
    scene = shown * (luminance[:, None] ** (1 / 1.2 - 1))
    high = 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073
    return np.where(scene <= 1 / 12, np.sqrt(3 * scene), high)


@pytest.mark.parametrize(("transfer", "encode"), [(PQ, as_pq), (HLG, as_hlg)])
def test_hdr_looks_as_the_same_scene_in_standard_range(transfer, encode):
    codes = np.rint(65_535 * encode(light_of(RGB)))[None].astype(np.uint16)
    found = tone_mapped(codes, transfer)[0, :, ::-1].astype(int)
    assert np.abs(found - RGB).max() <= 2


def test_what_is_brighter_than_white_is_white():
    assert (tone_mapped(np.full((1, 1, 3), 65_535, np.uint16), HLG) == 255).all()


def write_hlg(path, rgb, trc=HLG, count=3):
    """A 10-bit HEVC film as phones make them, of one colour."""
    codes = np.rint(65_535 * (as_hlg(light_of(np.array([rgb])))))[0].astype(np.uint16)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx265", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 64, "yuv420p10le"
        stream.codec_context.color_trc, stream.codec_context.color_primaries = trc, 9
        stream.codec_context.colorspace = 9
        stream.options = {"x265-params": "log-level=none"}
        for _ in range(count):
            frame = av.VideoFrame.from_ndarray(np.tile(codes, (64, 64, 1)), format="rgb48le")
            small = frame.reformat(format="yuv420p10le", dst_colorspace=9)
            small.color_trc, small.color_primaries = trc, 9
            container.mux(stream.encode(small))
        container.mux(stream.encode())
    return path


def test_a_film_in_hlg_is_recognised_and_tone_mapped(tmp_path):
    with av.open(str(write_hlg(tmp_path / "a.mov", (180, 90, 60)))) as container:
        frame = next(container.decode(video=0))
        assert hdr_kind(frame) == "HLG"
        found = bgr_picture(frame)[..., ::-1]
        small = bgr_picture(frame, (32, 16))
    assert np.abs(found.mean(axis=(0, 1)) - (180, 90, 60)).max() < 6
    assert small.shape == (16, 32, 3)
