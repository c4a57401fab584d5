from __future__ import annotations

import numpy as np
import pytest

from sim.bodies import UNIT_BOX_CORNERS
from sim.camera.shadows import MAX_DARKNESS, shadow_map

UP = np.array([0.0, 0.0, 1.0])
LIGHT = np.array([-0.6, 0.0, 0.8])
BOX = UNIT_BOX_CORNERS * (0.2, 0.2, 0.1) + (0.5, -0.4, 0.1)


def _light_at(shadow, x, y):
    column, row = ((np.array([x, y]) - shadow.low_xy) / shadow.cell_m).astype(int)
    return float(shadow.light[row, column])


def _shadow(solid, plane_z_m=0.0):
    return shadow_map([solid], plane_z_m, light_direction=LIGHT, ambient=0.55, key=0.5)


def test_it_is_darkest_under_the_body_and_light_far_away():
    shadow = _shadow(BOX)
    assert _light_at(shadow, 0.5, -0.4) == pytest.approx(1 - MAX_DARKNESS, abs=0.02)
    border = [shadow.light[0], shadow.light[-1], shadow.light[:, 0], shadow.light[:, -1]]
    assert np.min(border) > 1.0 - 0.5 / 255
    assert shadow.light.max() <= 1.0


def test_it_falls_away_from_the_light():
    shadow = _shadow(BOX)
    assert _light_at(shadow, 0.5 + 0.26, -0.4) < _light_at(shadow, 0.5 - 0.26, -0.4) - 0.1
    assert _light_at(shadow, 0.5, -0.4 + 0.26) == pytest.approx(
        _light_at(shadow, 0.5, -0.4 - 0.26), abs=0.05
    )


def test_a_lifted_body_casts_a_fainter_and_farther_shadow():
    low, high = _shadow(BOX), _shadow(BOX + 0.5 * UP)
    assert high.light.min() > low.light.min() + 0.1
    _, columns = np.nonzero(high.light < high.light.min() + 0.05)
    assert high.low_xy[0] + high.cell_m * columns.mean() > 0.7


def test_it_lies_on_the_surface_asked_for():
    on_table = _shadow(BOX + 0.7 * UP, plane_z_m=0.7)
    on_floor = _shadow(BOX)
    assert on_table.plane_z_m == 0.7
    assert np.abs(on_table.light - on_floor.light).max() < 0.05
