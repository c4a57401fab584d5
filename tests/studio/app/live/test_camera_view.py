"""Thumbnails show lens pictures upright, whatever the layout."""

from __future__ import annotations

import numpy as np
import pytest

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.received import Received
from devices.camera.stream_decoder import StreamPicture
from studio.app.live.camera_view import GAP_PX, lens_thumbnail


def received(*lumas):
    pictures = []
    for luma in lumas:
        half = np.full((luma.shape[0] // 2, luma.shape[1] // 2), 128, np.uint8)
        pictures.append(StreamPicture(luma, half, half, is_full_range=True))
    return Received(0, 0, 0, None, tuple(pictures))


def lit_at_the_top(size=128):
    luma = np.full((size, size), 20, np.uint8)
    luma[: size // 2] = 220
    return luma


@pytest.mark.parametrize("turns", [(0, 0), (1, 3), (2, 1)])
def test_lenses_are_upright_beside_each_other(turns):
    lenses = [np.rot90(lit_at_the_top(), -turn) for turn in turns]
    picture = received(np.ascontiguousarray(np.hstack(lenses)))
    layout = LensLayout(Arrangement.SIDE_BY_SIDE, turns)
    shown = lens_thumbnail(picture, layout, side_px=32)
    assert shown.shape == (32, 64 + GAP_PX, 4)
    for left in (0, 32 + GAP_PX):
        lens = shown[:, left : left + 32, :3].mean(axis=(1, 2))
        assert lens[:12].mean() > 180
        assert lens[20:].mean() < 60
    assert (shown[:, 32 : 32 + GAP_PX, 3] == 0).all()


def test_a_track_a_lens_and_no_layout():
    one = LensLayout(Arrangement.ONE_LENS, (0,))
    two = received(lit_at_the_top(), lit_at_the_top())
    assert lens_thumbnail(two, one, side_px=32).shape == (32, 64 + GAP_PX, 4)
    wide = received(np.hstack([lit_at_the_top(), lit_at_the_top()]))
    shown = lens_thumbnail(wide, None, side_px=32)
    assert shown.shape == (32, 64, 4)
    assert shown[:12, :, 0].mean() > 180
