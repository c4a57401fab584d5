"""`benchmarks.random_rooms.plan`: furniture inside the walls, apart, with places on it."""

import numpy as np
import pytest

from benchmarks.random_rooms.outlines import overlaps
from benchmarks.random_rooms.plan import random_plan


@pytest.fixture(scope="module", params=[1, 2, 3])
def plan(request):
    return random_plan(np.random.default_rng(request.param))


def test_furniture_is_inside_and_apart(plan):
    assert plan.furniture
    for k, piece in enumerate(plan.furniture):
        assert piece.is_inside(plan.inside.low[:2] - 1e-9, plan.inside.high[:2] + 1e-9)
        assert not any(overlaps(piece, other, 0.0) for other in plan.furniture[k + 1 :])


def test_there_is_light_and_somewhere_to_put_things(plan):
    assert len(plan.lights) >= 3
    assert plan.stands
    for stand in plan.stands:
        assert (np.array(stand.high) > np.array(stand.low)).all()
        assert 0.0 <= stand.z < 1.3


def test_pictures_fit_the_walls(plan):
    points = np.concatenate([s.points.reshape(-1, 3) for s in plan.parts.surfaces])
    # The frame of a door goes around it, below the floor too.
    door_frame_m = 0.07
    assert (points >= plan.inside.low - (0.03, 0.03, door_frame_m + 1e-6)).all()
    assert (points <= plan.inside.high + 0.03).all()


def test_rooms_differ():
    sizes = {tuple(random_plan(np.random.default_rng(k)).inside.high) for k in (1, 2, 3)}
    assert len(sizes) == 3
