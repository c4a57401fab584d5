import numpy as np
import pytest

from scenes.prepare.align.codes.corners import (
    _along_corners,
    _Fit,
    _homography,
    _map,
    refine_corners,
)
from scenes.prepare.align.codes.symbols import april_tag, qr_symbol
from tests.scenes.prepare.align.printed import photo_of, tilted_corners

CODE = qr_symbol("room:1")


@pytest.mark.parametrize(
    ("side_px", "tilt_deg", "blur_px", "limit_px"),
    [(120, 0, 0.6, 0.03), (90, 35, 0.8, 0.03), (90, 60, 0.8, 0.05), (45, 10, 0.8, 0.06)],
)
@pytest.mark.parametrize("symbol", [CODE, april_tag(3)], ids=["qr", "tag"])
def test_corners_are_found_to_hundredths_of_a_pixel(symbol, side_px, tilt_deg, blur_px, limit_px):
    rng = np.random.default_rng(7)
    errors = []
    for _ in range(4):
        corners = tilted_corners(side_px, tilt_deg, rng)
        photo = photo_of(symbol, corners, rng, blur_px=blur_px)
        start = corners + rng.normal(0, 0.2 * side_px / CODE.modules, (4, 2))
        found = refine_corners(photo, symbol, start)
        assert found is not None
        assert found.correlation > 0.95
        errors.append(found.pixels - corners)
        # The uncertainty it states is honest: not one in a hundred beyond four sigmas.
        assert (np.abs(errors[-1]) < 4 * found.sigma_px[:, None]).all()
    assert np.sqrt(np.mean(np.square(errors))) < limit_px


@pytest.mark.parametrize("side_px", [45, 120])
def test_from_close_by_the_same_corners_are_found_without_a_rough_fit(side_px, monkeypatch):
    rng, softened = np.random.default_rng(7), []
    corners = tilted_corners(side_px, 30, rng)
    photo = photo_of(CODE, corners, rng, blur_px=0.8)
    start = corners + rng.normal(0, 0.1 * side_px / CODE.modules, (4, 2))
    wanted = refine_corners(photo, CODE, start)
    run = _Fit.run

    def noted(fit, corners_px, *, soften_px):
        softened.append(soften_px)
        return run(fit, corners_px, soften_px=soften_px)

    monkeypatch.setattr(_Fit, "run", noted)
    found = refine_corners(photo, CODE, start, is_close=True)
    assert softened == [0.0]
    assert wanted is not None
    assert found is not None
    np.testing.assert_allclose(found.pixels, wanted.pixels, atol=0.01)
    np.testing.assert_allclose(found.sigma_px, wanted.sigma_px, rtol=0.1)


def test_a_large_code_is_measured_as_well_at_a_fraction_of_its_size():
    rng = np.random.default_rng(3)
    corners = tilted_corners(400, 20, rng, size=(640, 480))
    photo = photo_of(CODE, corners, rng, size=(640, 480), blur_px=1.2)
    found = refine_corners(photo, CODE, corners + 1.5)
    assert found is not None
    assert np.abs(found.pixels - corners).max() < 0.05


def test_another_code_in_its_place_is_unlike():
    rng = np.random.default_rng(1)
    corners = tilted_corners(90, 20, rng)
    found = refine_corners(photo_of(qr_symbol("room:2"), corners, rng), CODE, corners)
    assert found is None or found.correlation < 0.85


def test_blur_is_told():
    rng = np.random.default_rng(1)
    corners = tilted_corners(60, 10, rng)
    sharp, soft = (
        refine_corners(photo_of(CODE, corners, rng, blur_px=b), CODE, corners) for b in (0.6, 2.0)
    )
    assert sharp is not None
    assert soft is not None
    assert soft.blur_modules > 2 * sharp.blur_modules


@pytest.mark.parametrize(
    "start",
    [
        np.zeros((4, 2)),
        np.full((4, 2), np.nan),
        np.array([[-200.0, -200], [-100, -200], [-100, -100], [-200, -100]]),
        np.array([[50.0, 50], [150, 150], [150, 50], [50, 150]]),
    ],
    ids=["point", "nan", "outside", "twisted"],
)
def test_a_hopeless_start_gives_nothing(start):
    assert refine_corners(np.full((240, 320), 128, np.uint8), CODE, start) is None


def test_slopes_say_how_the_picture_changes_as_a_corner_goes():
    """The derivative of the homography, against differences."""
    rng = np.random.default_rng(5)
    printed = np.array([[0.0, 0.0], [21.0, 0.0], [21.0, 21.0], [0.0, 21.0]])
    corners = tilted_corners(90, 35, rng)
    at, slopes = rng.uniform(-2, 23, (50, 2)), rng.normal(size=(50, 2))
    found = _along_corners(slopes, at, from_xy=printed, to_xy=corners)
    tiny = 1e-4
    for k in range(8):
        step = np.zeros(8)
        step[k] = tiny
        ahead, behind = (
            _map(_homography(printed, corners + sign * step.reshape(4, 2)), at) for sign in (1, -1)
        )
        wanted = (slopes * (ahead - behind)).sum(axis=1) / (2 * tiny)
        np.testing.assert_allclose(found[:, k], wanted, atol=1e-6)
