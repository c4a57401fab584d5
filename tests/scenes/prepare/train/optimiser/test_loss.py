"""SSIM by its definition, and the loss's gradients by differences."""

import numpy as np
import pytest

from scenes.render.training import FARTHEST, SSIM_SHARE, DepthBounds, Exposure
from tests.twins import loss


def pictures(shape=(14, 17, 3), seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 1, shape), rng.uniform(0, 1, shape)


def test_ssim_of_a_pixel_is_what_wang_et_al_define():
    x, y = pictures()
    offsets = np.arange(-5, 6)
    weights = np.exp(-(offsets[:, None] ** 2 + offsets**2) / (2 * 1.5**2))
    weights /= weights.sum()
    row, column, channel = 6, 8, 1
    around = np.s_[row - 5 : row + 6, column - 5 : column + 6, channel]
    mean_x, mean_y = (weights * x[around]).sum(), (weights * y[around]).sum()
    variance_x = (weights * (x[around] - mean_x) ** 2).sum()
    variance_y = (weights * (y[around] - mean_y) ** 2).sum()
    covariance = (weights * (x[around] - mean_x) * (y[around] - mean_y)).sum()
    wanted = ((2 * mean_x * mean_y + 1e-4) * (2 * covariance + 9e-4)) / (
        (mean_x**2 + mean_y**2 + 1e-4) * (variance_x + variance_y + 9e-4)
    )
    assert loss.ssim(x, y)[0][row, column, channel] == pytest.approx(wanted, rel=1e-9)


def test_a_picture_is_like_itself():
    x, _ = pictures()
    similarity, gradient = loss.ssim(x, x)
    np.testing.assert_allclose(similarity, 1)
    np.testing.assert_allclose(gradient, 0, atol=1e-9)


def test_gradients_are_those_of_differences():
    x, y = pictures()
    exposure = Exposure((1.2, 0.8, 1.0), (0.03, -0.02, 0.0), (-0.2, 0.05))
    found, d_rgb = loss.distance(x, y, exposure)
    assert found.loss == pytest.approx((1 - SSIM_SHARE) * found.l1 + SSIM_SHARE * found.dssim)
    rng = np.random.default_rng(1)
    for place in map(tuple, rng.integers(0, x.shape, (20, 3))):
        step = np.zeros_like(x)
        step[place] = 1e-6
        slope = (
            loss.distance(x + step, y, exposure)[0].loss
            - loss.distance(x - step, y, exposure)[0].loss
        ) / 2e-6
        assert d_rgb[place] == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_exposure_gradients_are_those_of_differences(channel):
    x, y = pictures()

    def value(gain, bias, square=0.0, quartic=0.0):
        gains, biases = [1.2, 0.8, 1.0], [0.03, -0.02, 0.0]
        gains[channel] += gain
        biases[channel] += bias
        falloff = (-0.2 + square, 0.05 + quartic)
        return loss.distance(x, y, Exposure(tuple(gains), tuple(biases), falloff))[0]

    here = value(0, 0)
    by_gain = (value(1e-6, 0).loss - value(-1e-6, 0).loss) / 2e-6
    by_bias = (value(0, 1e-6).loss - value(0, -1e-6).loss) / 2e-6
    assert here.d_gain[channel] == pytest.approx(by_gain, abs=1e-7)
    assert here.d_bias[channel] == pytest.approx(by_bias, abs=1e-7)
    by_square = (value(0, 0, 1e-6).loss - value(0, 0, -1e-6).loss) / 2e-6
    by_quartic = (value(0, 0, 0, 1e-6).loss - value(0, 0, 0, -1e-6).loss) / 2e-6
    np.testing.assert_allclose(here.d_falloff, (by_square, by_quartic), atol=1e-7)


def test_falloff_is_one_in_the_centre_and_the_sum_of_its_terms_in_the_corners():
    seen = loss.as_seen(np.ones((101, 201, 3)), Exposure(falloff=(-0.3, 0.1)))
    assert seen[50, 100, 0] == 1
    assert seen[0, 0, 0] == pytest.approx(0.8, abs=0.01)


BOUNDS = DepthBounds(
    np.array([[2.0, 2.0, 0.0]], dtype=np.float32),
    np.array([[2.1, FARTHEST, FARTHEST]], dtype=np.float32),
)


@pytest.mark.parametrize(
    ("depth", "wanted"),
    [
        (2.05, [0, 0, 0]),
        (1.96, [2 / 1.96 - 1, 2 / 1.96 - 1, 0]),
        (2.15, [1 - 2.1 / 2.15, 0, 0]),
        (1.0, [loss.MAX_DEPTH_ERROR, loss.MAX_DEPTH_ERROR, 0]),
        (50.0, [loss.MAX_DEPTH_ERROR, 0, 0]),
    ],
)
def test_light_off_the_bounds_costs_its_share_of_the_depth_up_to_a_limit(depth, wanted):
    price, slope = loss.price_off_bounds(depth, BOUNDS)
    np.testing.assert_allclose(price, [wanted], atol=1e-7)
    step = 1e-5
    above, below = (loss.price_off_bounds(depth + s, BOUNDS)[0] for s in (step, -step))
    np.testing.assert_allclose(slope, (above - below) / (2 * step), atol=1e-6)
