"""A stool on a carpet whose legs the masks lost."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.prepare.cutout.labelling.above_ground import hanging_on, standing
from scenes.splats import SplatCloud, concatenate

WOOD, CARPET = (0.6, 0.4, 0.25), (0.6, 0.6, 0.65)


def splats(points, colour, rng):
    n = len(points)
    sh = (np.asarray(colour) + rng.normal(0, 0.02, (n, 1)) - 0.5) / 0.2820948
    turns = np.tile([1.0, 0, 0, 0], (n, 1))
    return SplatCloud(points, np.full((n, 3), 0.01), turns, np.full(n, 0.9), sh[:, None, :])


@pytest.fixture
def room():
    """Splats, and which they are: 0 the floor, 1 legs, 2 the seat, 3 carpet that hangs in the air,
    4 a shelf that reaches from the seat far beyond it."""
    rng = np.random.default_rng(1)
    corners = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])[rng.integers(0, 4, 800)] * 0.13
    legs = np.column_stack([corners, rng.uniform(0, 0.42, 800)]) + rng.normal(0, 0.006, (800, 3))
    parts = [
        splats(rng.uniform((-1, -1, -0.003), (1, 1, 0.003), (20_000, 3)), CARPET, rng),
        splats(legs, WOOD, rng),
        splats(rng.uniform((-0.18, -0.18, 0.42), (0.18, 0.18, 0.45), (1500, 3)), WOOD, rng),
        splats(rng.uniform((-0.1, -0.1, 0.03), (0.1, 0.1, 0.08), (300, 3)), CARPET, rng),
        splats(rng.uniform((0.16, -0.1, 0.42), (0.9, 0.1, 0.45), (3000, 3)), WOOD, rng),
    ]
    kind = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    return concatenate(parts), kind


def test_the_legs_hang_on_the_seat_and_the_carpet_in_the_air_does_not(room):
    cloud, kind = room
    cloud, kind = cloud.select(kind < 4), kind[kind < 4]
    in_boxes = (np.abs(cloud.means[:, :2]) < 0.25).all(axis=1)
    hanging = hanging_on(cloud, kind == 2, in_boxes, in_boxes=in_boxes, weights=np.ones(len(cloud)))
    legs = (kind == 1) & standing(cloud, in_boxes)
    assert legs.sum() > 600
    assert hanging[legs].mean() > 0.95
    assert hanging[kind == 3].mean() < 0.05
    assert not hanging[kind == 0].any()


def test_what_goes_on_outside_the_boxes_says_nothing(room):
    cloud, kind = room
    in_boxes = (np.abs(cloud.means[:, :2]) < 0.25).all(axis=1)
    assert not hanging_on(
        cloud, kind == 2, in_boxes, in_boxes=in_boxes, weights=np.ones(len(cloud))
    ).any()


def test_a_back_of_the_carpets_colour_hangs_on_the_seat(room):
    cloud, kind = room
    rng = np.random.default_rng(2)
    back = splats(rng.uniform((-0.18, 0.16, 0.45), (0.18, 0.18, 0.8), (1500, 3)), CARPET, rng)
    whole = concatenate([cloud.select(kind < 4), back])
    kind = np.append(kind[kind < 4], np.full(len(back), 5))
    in_boxes = (np.abs(whole.means[:, :2]) < 0.25).all(axis=1)
    hanging = hanging_on(whole, kind == 2, in_boxes, in_boxes=in_boxes, weights=np.ones(len(whole)))
    assert hanging[kind == 5].mean() > 0.8
    assert hanging[kind == 3].mean() < 0.05


def test_a_few_long_splats_do_not_tie_it_to_what_stands_beside(room):
    cloud, kind = room
    rng = np.random.default_rng(3)
    beside = splats(rng.uniform((0.27, -0.1, 0.42), (0.9, 0.1, 0.45), (3000, 3)), WOOD, rng)
    middle = np.array([[0.225, y, 0.43] for y in (-0.05, 0.0, 0.05)])
    bridge = splats(middle, WOOD, rng)
    bridge = replace(bridge, scales=np.full((3, 3), 0.004) + np.array([0.03, 0, 0]))
    whole = concatenate([cloud.select(kind < 4), beside, bridge])
    kind = np.concatenate([kind[kind < 4], np.full(len(beside), 4), np.full(3, 5)])
    in_boxes = (np.abs(whole.means[:, :2]) < 0.25).all(axis=1)
    hanging = hanging_on(whole, kind == 2, in_boxes, in_boxes=in_boxes, weights=np.ones(len(whole)))
    assert hanging[(kind == 1) & standing(whole, in_boxes)].mean() > 0.95
    assert not hanging[kind == 4].any()
