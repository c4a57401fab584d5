# pyright: standard
"""Training loss, in numpy: L1 + D-SSIM of a picture against a photo, and its gradient.

Native: `scenes.render.training.TrainingTarget.distance`; tests hold them together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from scenes.prepare.train.optimiser.exposure import as_seen, falloff_of
from scenes.render.training import SSIM_SHARE, DepthBounds, Distance, Exposure

FloatArray = NDArray[np.float64]

SIGMA_PX = 1.5
"""Deviation of SSIM's window, px (Wang et al. 2004)."""
REACH_PX = 5
"""Half width of SSIM's window, px: 11 pixels across."""
C1, C2 = 0.01**2, 0.03**2
"""The window and the constants of Wang et al. 2004."""


def distance(rgb: FloatArray, photo: FloatArray, exposure: Exposure) -> tuple[Distance, FloatArray]:
    """Distance of a drawn picture from a photo and the loss's gradient by the picture.

    Args:
        rgb: (H, W, 3), as drawn.
        photo: (H, W, 3), 0..1.
        exposure: what the photo shows of colours drawn.
    """
    powers, falloff = falloff_of(rgb, exposure)
    gain = np.array(exposure.gain) * falloff
    seen = as_seen(rgb, exposure)
    similarity, d_similarity = ssim(seen, photo)
    count = seen.size
    d_seen = ((1 - SSIM_SHARE) * np.sign(seen - photo) - SSIM_SHARE * d_similarity) / count
    d_gain = (d_seen * falloff * rgb).sum(axis=(0, 1))
    d_falloff = ((d_seen * gain / falloff * rgb).sum(axis=2, keepdims=True) * powers).sum((0, 1))
    d_bias = d_seen.sum(axis=(0, 1))
    found = Distance(
        l1=float(np.abs(seen - photo).mean()),
        dssim=1 - float(similarity.mean()),
        d_gain=(float(d_gain[0]), float(d_gain[1]), float(d_gain[2])),
        d_bias=(float(d_bias[0]), float(d_bias[1]), float(d_bias[2])),
        d_falloff=(float(d_falloff[0]), float(d_falloff[1])),
    )
    return found, gain * d_seen


def ssim(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(H, W, 3) SSIM of every pixel and channel, and the gradient of its sum by `x`."""
    mean_x, mean_y = _window(x), _window(y)
    variance_x = _window(x * x) - mean_x**2
    variance_y = _window(y * y) - mean_y**2
    covariance = _window(x * y) - mean_x * mean_y
    light_top, light_under = 2 * mean_x * mean_y + C1, mean_x**2 + mean_y**2 + C1
    shape_top, shape_under = 2 * covariance + C2, variance_x + variance_y + C2
    light, shape = light_top / light_under, shape_top / shape_under
    by_variance = -light * shape / shape_under
    by_covariance = 2 * light / shape_under
    by_mean = 2 * (mean_y - mean_x * light) / light_under * shape
    # Variance and covariance also follow the mean.
    by_mean += -2 * mean_x * by_variance - mean_y * by_covariance
    gradient = _window(by_mean) + 2 * x * _window(by_variance) + y * _window(by_covariance)
    return light * shape, gradient


def _window(values: FloatArray) -> FloatArray:
    """Gaussian mean of every channel, zero beyond the border; its own adjoint."""
    offsets = np.arange(-REACH_PX, REACH_PX + 1)
    weights = np.exp(-0.5 * (offsets / SIGMA_PX) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        values = correlate1d(values, weights, axis=axis, mode="constant")
    return values


MAX_DEPTH_ERROR = 0.04
"""Beyond so much of its depth from a surface a splat costs no more, and is drained where it is."""


def price_off_bounds(depth: float, bounds: DepthBounds) -> tuple[FloatArray, FloatArray]:
    """Cost of a unit of blend weight at a depth, by pixel, and its slope by the depth.

    near / depth - 1 in front of the bounds, 1 - far / depth behind them, nothing between them, and
    at most `MAX_DEPTH_ERROR`, from where on it does not pull any more.

    Args:
        depth: of a splat, as the lens measures it.
        bounds: (H, W) each.

    Returns:
        (H, W) price and (H, W) slope, per metre.
    """
    near, far = bounds.near.astype(np.float64) / depth, bounds.far.astype(np.float64) / depth
    off = np.maximum(near - 1, 0) + np.maximum(1 - far, 0)
    slope = np.where(far <= 1, far, 0.0) - np.where(near >= 1, near, 0.0)
    return np.minimum(off, MAX_DEPTH_ERROR), np.where(off <= MAX_DEPTH_ERROR, slope / depth, 0.0)
