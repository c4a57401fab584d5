import cv2
import numpy as np
import pytest

from scenes.pose import Pose
from tracking.background.images import (
    BackgroundImages,
    Exposure,
    LensExposures,
    background_noise,
    difference,
    expose,
    fit_exposure,
)

SIZE = 240


@pytest.fixture(scope="module")
def background_image():
    """A room-like picture: smooth shades, some lines and some texture."""
    rng = np.random.default_rng(7)
    shades = cv2.resize(rng.uniform(0.25, 0.85, (6, 6, 3)).astype(np.float32), (SIZE, SIZE))
    cv2.line(shades, (0, 160), (SIZE, 120), (0.2, 0.25, 0.3), 3)
    return np.clip(shades + 0.02 * rng.standard_normal((SIZE, SIZE, 1)), 0, 1).astype(np.float32)


def radius2():
    x = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    return (x[None, :] ** 2 + x[:, None] ** 2).astype(np.float32)


def live_picture(background_image, exposure, *, rng=None):
    shown = expose(background_image, exposure, radius2=radius2())
    if rng is not None:
        shown = shown + rng.normal(0, 0.01, shown.shape)
    return np.clip(shown * 255 + 0.5, 0, 255).astype(np.uint8)


GAINS = Exposure(np.array([1.15, 1.05, 0.95]), np.array([-0.2, -0.2, -0.2]), np.full(3, 0.02))
NEUTRAL = Exposure(np.ones(3), np.zeros(3), np.zeros(3))


def test_exposure_is_found_in_spite_of_a_person(background_image):
    live = live_picture(background_image, GAINS, rng=np.random.default_rng(1))
    live[60:220, 90:150] = (60, 20, 20)
    fit = fit_exposure(live, background_image, np.ones((SIZE, SIZE), np.float32))
    exposed = expose(background_image, fit, radius2=radius2())
    true = expose(background_image, GAINS, radius2=radius2())
    assert np.abs(exposed - true).mean() < 0.006


def test_a_lens_is_fitted_by_its_own_picture_and_once(background_image):
    images = [live_picture(background_image, GAINS), live_picture(background_image, NEUTRAL)]
    whole = np.ones((SIZE, SIZE), np.float32)
    background = BackgroundImages.of_pictures(
        Pose.identity(), [background_image, background_image], [whole, whole]
    )
    exposures = LensExposures(images, background)
    assert exposures[0] is exposures[0]
    for lens, image in enumerate(images):
        wanted = fit_exposure(image, background_image, whole)
        np.testing.assert_array_equal(exposures[lens].gain, wanted.gain)
        np.testing.assert_array_equal(exposures[lens].offset, wanted.offset)


def test_a_picture_of_nothing_keeps_the_background_image(background_image):
    fit = fit_exposure(
        np.zeros((SIZE, SIZE, 3), np.uint8), background_image, np.zeros((SIZE, SIZE), np.float32)
    )
    np.testing.assert_array_equal(fit.gain, np.ones(3))


def test_gain_makes_no_foreground_but_an_object_does(background_image):
    live = live_picture(background_image, GAINS, rng=np.random.default_rng(2))
    live[100:140, 100:140] = (40, 60, 160)
    fit = fit_exposure(live, background_image, np.ones((SIZE, SIZE), np.float32))
    expected = expose(background_image, fit, radius2=radius2())
    change = difference(live.astype(np.float32) / 255, expected, background_noise(expected))
    outside = change.mask().copy()
    outside[96:144, 96:144] = False
    assert outside.mean() < 0.01
    assert change.mask()[103:137, 103:137].mean() > 0.97


def test_a_shadow_is_no_foreground_but_a_grey_thing_of_that_brightness_is(background_image):
    expected = background_image
    shade = np.ones((SIZE, SIZE, 1), np.float32)
    shade[60:180, 60:180] = 0.72
    shade = cv2.GaussianBlur(shade, (0, 0), 6)[..., None]
    noise = np.random.default_rng(3).normal(0, 0.01, background_image.shape)
    shadowed = np.clip(background_image * shade + noise, 0, 1).astype(np.float32)
    in_shadow = difference(shadowed, expected, background_noise(expected)).mask()[80:160, 80:160]
    assert in_shadow.mean() < 0.03

    physical = shadowed.copy()
    level = 0.72 * background_image[80:160, 80:160].mean()
    physical[80:160, 80:160] = level + noise[80:160, 80:160]
    as_thing = difference(physical, expected, background_noise(expected)).mask()[80:160, 80:160]
    assert as_thing.mean() > 0.7


def test_edges_of_the_background_image_may_be_half_a_pixel_off(background_image):
    matrix = np.array([[1, 0, 0.4], [0, 1, -0.3]], np.float32)
    moved = cv2.warpAffine(background_image, matrix, (SIZE, SIZE), borderMode=cv2.BORDER_REFLECT)
    assert (
        difference(moved, background_image, background_noise(background_image)).mask().mean() < 0.01
    )
