"""Gains and biases."""

import numpy as np

from scenes.prepare.train.optimiser.exposure import Exposures, as_seen, fitted
from scenes.render.training import Distance, Exposure

NO_SLOPE = Distance(0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0))


def test_they_move_against_their_gradients_and_no_other_view_does():
    exposures = Exposures(3)
    exposures.step(1, Distance(0, 0, (1.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.5, 0.0)))
    moved = exposures.of(1)
    assert moved.gain[0] < 1 < moved.gain[1]
    assert moved.bias[1] < 0
    assert exposures.of(0) == exposures.of(2)
    assert exposures.of(0).gain == (1.0, 1.0, 1.0)
    # The lens is the same for all.
    assert exposures.of(0).falloff == moved.falloff == exposures.lens().falloff
    assert moved.falloff[0] < 0 == moved.falloff[1]


def test_without_gradients_they_go_back_to_as_drawn():
    exposures = Exposures(1)
    exposures.values[:6] = [1.3, 0.7, 1.0, 0.1, -0.1, 0.0]
    for _ in range(500):
        exposures.step(0, NO_SLOPE)
    np.testing.assert_allclose(exposures.of(0).gain, 1, atol=0.01)
    np.testing.assert_allclose(exposures.of(0).bias, 0, atol=0.01)


def test_a_gain_and_a_bias_are_found_again():
    photo = np.random.default_rng(0).uniform(0, 1, (9, 8, 3)).astype(np.float32)
    drawn = (photo - np.float32(0.1)) / np.float32(1.4)
    np.testing.assert_allclose(fitted(drawn, photo, Exposure()), photo, atol=1e-5)
    flat = np.full_like(photo, 0.5)
    means = photo.mean(axis=(0, 1))
    np.testing.assert_allclose(fitted(flat, photo, Exposure()).mean(axis=(0, 1)), means, 1e-5)


def test_a_dark_corner_is_the_lens_and_not_the_scene():
    drawn = np.random.default_rng(0).uniform(0.2, 1, (9, 8, 3)).astype(np.float32)
    lens = Exposure(falloff=(-0.3, 0.05))
    photo = as_seen(drawn.astype(np.float64), lens).astype(np.float32)
    np.testing.assert_allclose(fitted(drawn, photo, lens), photo, atol=1e-5)
