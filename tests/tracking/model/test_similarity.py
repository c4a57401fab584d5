"""Similarity of a drawn object and a picture: the native kernel and its twin, and sense."""

import numpy as np
import pytest

from tracking.kernels import native
from tracking.kernels.photometry import CLOSELY, ROUGHLY
from tracking.model.similarity import Setting
from tracking.window.filters import bell_blurred


def blot(rng, shape, centre, radius):
    """Colours and alpha of a speckled disc."""
    rows, columns = np.indices(shape)
    apart = np.hypot(rows - centre[0], columns - centre[1])
    alpha = np.clip(radius + 0.5 - apart, 0.0, 1.0).astype(np.float32)
    speckled = bell_blurred(rng.uniform(0.1, 0.9, (*shape, 3)).astype(np.float32), 1.0, 3)
    return np.ascontiguousarray(speckled * alpha[..., None]), alpha


def pictures(shape):
    """An empty room, a thing drawn in it, and what a camera makes of both."""
    rng = np.random.default_rng(5)
    empty = bell_blurred(rng.uniform(0.3, 0.7, (*shape, 3)).astype(np.float32), 2.0, 6)
    rgb, alpha = blot(rng, shape, (shape[0] / 2, shape[1] / 2), 0.35 * min(shape))
    sharp = rgb + (1.0 - alpha)[..., None] * empty
    live = bell_blurred(sharp, 0.6, 2) + rng.normal(0.0, 0.02, sharp.shape)
    return live.astype(np.float32), empty, rgb, alpha


@pytest.mark.parametrize("closely", [False, True], ids=["roughly", "closely"])
@pytest.mark.parametrize("shape", [(31, 40), (9, 60), (5, 3)], ids=str)
def test_the_native_kernel_says_what_its_twin_says(shape, closely):
    live, empty, rgb, alpha = pictures(shape)
    free = np.ones(shape, np.float32)
    free[:, : shape[1] // 3] = 0.3
    size = (free.shape[1], free.shape[0])
    options = CLOSELY if closely else ROUGHLY
    kernel = native.Setting(live, empty, free, size=size, constants=options.for_native())
    twin = Setting(live, empty, free, options)
    for shift in (0, 1, 2):
        drawn = np.roll(rgb, shift, axis=1), np.roll(alpha, shift, axis=1)
        assert kernel.strange(*drawn) == pytest.approx(twin.residual_px(*drawn), rel=1e-4, abs=1e-4)
        wanted = twin.similarity(*drawn)
        assert kernel.resemblance(*drawn) == pytest.approx(wanted, rel=1e-3, abs=1e-4)


def test_another_place_is_not_forgiven():
    live, empty, rgb, alpha = pictures((31, 40))
    setting = Setting(live, empty, np.ones_like(alpha))
    assert setting.similarity(rgb, alpha) > 0.7
    beside = np.roll(rgb, 5, axis=1), np.roll(alpha, 5, axis=1)
    assert setting.similarity(*beside) < 0.3
    assert setting.residual_px(*beside) > 2.0 * setting.residual_px(rgb, alpha)


@pytest.mark.parametrize("name", ["live", "empty", "free"])
def test_pictures_of_another_size_are_refused(name):
    arrays = {
        "live": np.zeros((4, 5, 3), np.float32),
        "empty": np.zeros((4, 5, 3), np.float32),
        "free": np.zeros((4, 5), np.float32),
    }
    arrays[name] = arrays[name][:3].copy()
    with pytest.raises(ValueError, match=f"{name}: .* values, wanted"):
        native.Setting(**arrays, size=(5, 4), constants=ROUGHLY.for_native())
