import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.prepare.cutout.object.level_top import level_top


def seat(rng, tilt, noise_m, height_m=0.45):
    """A rough seat, tilted about its middle, and four legs."""
    top = rng.uniform((-0.18, -0.18, 0.0), (0.18, 0.18, 0.0), (4000, 3))
    top[:, 2] = height_m + tilt * top[:, 0] + rng.normal(0.0, noise_m, len(top))
    legs = rng.uniform((-0.01, -0.01, 0.0), (0.01, 0.01, height_m - 0.03), (4000, 3))
    legs[:, :2] += rng.choice([-0.12, 0.12], (len(legs), 2))
    return np.concatenate([top, legs])


@settings(max_examples=30, deadline=None)
@given(tilt=st.floats(-0.1, 0.1), noise_m=st.floats(0.0, 0.004))
def test_a_rough_tilted_seat_is_as_high_as_its_middle(tilt, noise_m):
    points = seat(np.random.default_rng(3), tilt, noise_m)
    found = level_top(points, points[:, 2].max())
    assert found is not None
    assert abs(found - 0.45) < 0.006


def test_a_back_is_no_level_top_nor_is_a_wall_or_a_ramp():
    rng = np.random.default_rng(4)
    back = rng.uniform((-0.2, -0.01, 0.5), (0.2, 0.01, 0.9), (4000, 3))
    chair = np.concatenate([seat(rng, 0.0, 0.002), back])
    assert level_top(chair, chair[:, 2].max()) is None
    turn = rng.uniform(0, 2 * np.pi, 4000)
    wall = np.stack([0.04 * np.cos(turn), 0.04 * np.sin(turn), rng.uniform(0, 0.09, 4000)], axis=1)
    assert level_top(wall, wall[:, 2].max()) is None
    ramp = seat(rng, 0.5, 0.0)
    assert level_top(ramp, ramp[:, 2].max()) is None
