import math

import cv2
import numpy as np
import pytest

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import lens_pictures
from scenes.cameras import Fisheye, pixel_centres
from sim.wire.film.layouts import Layout, lens_size_px, packed
from tests.stream_pictures import picture_from_rgb

SIDE = 256
LENS = Fisheye.from_fov(SIDE, math.radians(200))
READ_AS = {
    Layout.SIDE_BY_SIDE: LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0)),
    Layout.STACKED: LensLayout(Arrangement.STACKED, (0, 0)),
    Layout.TURNED: LensLayout(Arrangement.SIDE_BY_SIDE, (1, 3)),
    Layout.EQUIRECTANGULAR: LensLayout(Arrangement.EQUIRECTANGULAR, (0,)),
}


@pytest.fixture(scope="module")
def images():
    """A smooth picture for either lens, in which every place has a colour of its own."""
    rng = np.random.default_rng(5)
    inside = np.arccos(np.clip(LENS.unproject(pixel_centres(LENS))[:, 2], -1, 1)) < math.radians(85)
    made = []
    for _lens in range(2):
        small = rng.integers(60, 200, (6, 6, 3), np.uint8)
        made.append(cv2.resize(small, (SIDE, SIDE), interpolation=cv2.INTER_CUBIC))
    return made, inside.reshape(SIDE, SIDE)


@pytest.mark.parametrize("layout", Layout)
def test_the_studio_takes_the_lens_pictures_out_again(layout, images):
    taken, inside = images
    whole = packed(taken, layout, LENS)
    width, height = whole.shape[1], whole.shape[0]
    assert lens_size_px(layout, (width, height)) == SIDE
    again = lens_pictures(picture_from_rgb(whole), READ_AS[layout], lens_size_px=SIDE)
    for before, after in zip(taken, again, strict=True):
        error = np.abs(before.astype(int) - after.astype(int))[inside]
        assert error.mean() < 2.5, layout


@pytest.mark.parametrize(
    ("layout", "size"), [(Layout.SIDE_BY_SIDE, (300, 200)), (Layout.STACKED, (320, 160))]
)
def test_a_size_that_cannot_be_filled_is_refused(layout, size):
    with pytest.raises(ValueError, match=layout):
        lens_size_px(layout, size)
