"""A stool on a carpet."""

import numpy as np

from scenes.prepare.cutout.labelling.above_ground import standing
from scenes.splats import SplatCloud, concatenate

WOOD, CARPET = (0.6, 0.4, 0.25), (0.6, 0.6, 0.65)


def splats(points, colour, rng):
    n = len(points)
    sh = (np.asarray(colour) + rng.normal(0, 0.02, (n, 1)) - 0.5) / 0.2820948
    turns = np.tile([1.0, 0, 0, 0], (n, 1))
    return SplatCloud(points, np.full((n, 3), 0.01), turns, np.full(n, 0.9), sh[:, None, :])


def test_legs_and_seat_stand_on_a_carpet_and_the_carpet_does_not():
    rng = np.random.default_rng(1)
    corners = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])[rng.integers(0, 4, 800)] * 0.13
    legs = np.column_stack([corners, rng.uniform(0.03, 0.42, 800)])
    legs += rng.normal(0, 0.003, legs.shape)
    parts = [
        splats(rng.uniform((-1, -1, -0.003), (1, 1, 0.003), (20_000, 3)), CARPET, rng),
        splats(legs, WOOD, rng),
        splats(rng.uniform((-0.18, -0.18, 0.42), (0.18, 0.18, 0.45), (1500, 3)), WOOD, rng),
    ]
    cloud = concatenate(parts)
    kind = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    within = (np.abs(cloud.means[:, :2]) < 0.25).all(axis=1)
    above = standing(cloud, within)
    assert above[kind > 0].mean() > 0.97
    assert not above[kind == 0].any()
