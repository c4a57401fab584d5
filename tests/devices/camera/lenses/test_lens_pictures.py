"""Pictures laid out by plain numpy come back upright."""

import cv2
import numpy as np
import pytest

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import assumed_rig, lens_pictures
from devices.camera.stream_decoder import StreamPicture
from scenes.cameras import pixel_centres
from tests.stream_pictures import picture_from_rgb

SIZE = 128


def smooth(seed, size=SIZE):
    """A picture that survives halved chroma."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(40, 215, (4, 4, 3), dtype=np.uint8)
    return cv2.resize(coarse, (size, size), interpolation=cv2.INTER_CUBIC)


def difference(a, b):
    return float(np.abs(a.astype(float) - b.astype(float)).mean())


@pytest.mark.parametrize("turns", [(0, 0), (1, 1), (2, 2), (1, 3), (3, 1)])
@pytest.mark.parametrize("arrangement", [Arrangement.SIDE_BY_SIDE, Arrangement.STACKED])
def test_two_lenses_come_back_upright(arrangement, turns):
    lenses = [smooth(1), smooth(2)]
    turned = [np.rot90(lens, -turn) for lens, turn in zip(lenses, turns, strict=True)]
    axis = 1 if arrangement is Arrangement.SIDE_BY_SIDE else 0
    stream = picture_from_rgb(np.ascontiguousarray(np.concatenate(turned, axis=axis)))
    images = lens_pictures(stream, LensLayout(arrangement, turns))
    for image, lens in zip(images, lenses, strict=True):
        assert difference(image, lens) < 2.0
        assert not image.flags.writeable


def test_a_smaller_size_is_given():
    lenses = [smooth(seed, 512) for seed in (1, 2)]
    stream = picture_from_rgb(np.concatenate(lenses, axis=1))
    layout = LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0))
    images = lens_pictures(stream, layout, lens_size_px=256)
    small = cv2.resize(lenses[1], (256, 256), interpolation=cv2.INTER_AREA)
    assert images[1].shape == (256, 256, 3)
    assert difference(images[1], small) < 2.0


@pytest.mark.parametrize("turn", range(4))
def test_a_sphere_becomes_what_both_lenses_see_in_every_direction(turn):
    # The colour of a direction is the direction itself, so what a lens should see is known.
    height, width = 256, 512
    down = (np.arange(height) + 0.5) / height * np.pi - np.pi / 2
    right = (np.arange(width) + 0.5) / width * 2 * np.pi - np.pi
    lat, lon = np.meshgrid(down, right, indexing="ij")
    rays = np.stack([np.sin(lon) * np.cos(lat), np.sin(lat), np.cos(lon) * np.cos(lat)], axis=-1)
    sphere = np.round(128 + 80 * rays).astype(np.uint8)
    stream = picture_from_rgb(np.ascontiguousarray(np.rot90(sphere, -turn)))
    layout = LensLayout(Arrangement.EQUIRECTANGULAR, (turn,))
    rig = assumed_rig(layout, SIZE)
    images = lens_pictures(stream, layout, lens_size_px=SIZE)
    for image, lens, pose in zip(images, rig.lenses, rig.rig_from_lens, strict=True):
        in_lens = lens.unproject(pixel_centres(lens))
        inside = np.arccos(in_lens[:, 2]) < 0.97 * lens.max_angle
        wanted = 128 + 80 * (in_lens @ pose.rotation.T)
        assert np.abs(image.reshape(-1, 3)[inside] - wanted[inside]).mean() < 2.0
        assert image[0, 0].max() < 5


@pytest.mark.parametrize("size", [15, 8])
def test_odd_and_tiny_sizes_are_refused(size):
    with pytest.raises(ValueError, match="even size"):
        lens_pictures(
            picture_from_rgb(smooth(1)), LensLayout(Arrangement.ONE_LENS, (0,)), lens_size_px=size
        )


@pytest.mark.parametrize(("matrix", "red"), [("bt709", (63, 102, 240)), ("bt601", (82, 90, 240))])
def test_colours_follow_the_matrix(matrix, red):
    y, u, v = (
        np.full(shape, value, np.uint8)
        for shape, value in zip(((4, 4), (2, 2), (2, 2)), red, strict=True)
    )
    rgb = StreamPicture(y, u, v, False, matrix).rgb()
    assert np.abs(rgb.astype(int) - [255, 0, 0]).max() <= 3
