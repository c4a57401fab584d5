"""What a window shows if the object is not in it."""

import numpy as np
import pytest

from tracking.evidence.observation import observe
from tracking.model.misfit import MOST_MISFIT, RESIDUAL_SIGMA, misfit


def test_a_misfit_is_half_the_squared_residual_up_to_any_colour():
    residual = np.zeros((1, 3, 3), np.float32)
    residual[0, 1] = RESIDUAL_SIGMA
    residual[0, 2] = 1.0
    np.testing.assert_allclose(misfit(residual)[0], [0.0, 1.5, MOST_MISFIT], rtol=1e-5)


def test_the_room_misfits_where_something_stands_and_fits_elsewhere(table, as_scanned):
    evidence = table.evidence(as_scanned, "box-1", table.poses["box-1"])
    observation = observe(as_scanned, evidence)
    surely, hardly = evidence.foreground > 0.95, evidence.foreground < 0.02
    assert surely.any()
    assert hardly.any()
    assert np.median(observation.room_misfit[surely]) > 3.0
    assert observation.room_misfit[hardly].max() < 0.2
    assert observation.lens_px == evidence.view.shrink
    assert observation.range_m.max() > 0.5


def test_a_shrunk_observation_shows_the_same_with_fewer_pixels(table, as_scanned):
    observation = observe(as_scanned, table.evidence(as_scanned, "box-1", table.poses["box-1"]))
    half = observation.shrunk(2)
    assert half.live.shape[0] == observation.live.shape[0] // 2
    assert half.camera.f_px == pytest.approx(observation.camera.f_px / 2)
    assert half.lens_px == 2 * observation.lens_px
    assert half.live.mean() == pytest.approx(observation.live.mean(), abs=0.01)
    assert observation.shrunk(1) is observation
    assert observation.shrunk(10_000) is observation
