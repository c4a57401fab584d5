"""Places given to objects, each once."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.assignment import Searched, claims, is_same_spot
from tracking.hypotheses.hypothesis import Guess
from tracking.model.templates import SMALL_PX, YAWS, Templates

PIXELS = SMALL_PX * SMALL_PX


def a_model(name, *, radius_m=0.5, narrow_m=0.3):
    """A model whose yaws all look different."""
    alpha = np.zeros((4, YAWS, PIXELS), np.float32)
    for yaw in range(YAWS):
        alpha[:, yaw, yaw * 40 : yaw * 40 + 40] = 1.0
    alike = np.arange(YAWS) == 0
    templates = Templates(alpha, np.zeros((*alpha.shape, 3), np.float32), alike)
    return SimpleNamespace(
        object_id=name,
        radius_m=radius_m,
        symmetry=1,
        templates=templates,
        source=SimpleNamespace(box_m=(narrow_m, 0.6, 0.6)),
    )


def a_guess(x, quality, *, yaw_deg=0.0, points=240):
    sketch = SimpleNamespace(contour=range(points))
    pose = Pose.from_yaw(math.radians(yaw_deg), (x, 0.0, 0.0))
    fit = SimpleNamespace(world_from_object=pose, quality=quality, sketch=sketch, textured=True)
    return Guess(fit, None)


def looked_for(name, last_x, *fits):
    return Searched(a_model(name), Pose.from_yaw(0.0, (last_x, 0.0, 0.0)), fits)


def test_two_objects_never_get_one_place_and_the_total_counts():
    found = claims(
        [
            looked_for("a", 0.0, a_guess(1.0, 0.9), a_guess(3.0, 0.85)),
            looked_for("b", 0.0, a_guess(1.01, 0.8)),
        ]
    )
    assert found["a"].guess.world_from_object.translation[0] == pytest.approx(3.0)
    assert found["b"].guess.world_from_object.translation[0] == pytest.approx(1.01)


@pytest.mark.parametrize("order", [1, -1])
def test_twins_get_the_places_nearest_to_their_last_ones(order):
    fits = (a_guess(1.0, 0.9), a_guess(3.0, 0.9))
    found = claims([looked_for("a", 2.6, *fits), looked_for("b", 1.3, *fits)][::order])
    assert found["a"].guess.world_from_object.translation[0] == 3.0
    assert found["b"].guess.world_from_object.translation[0] == 1.0
    assert found["a"].place_is_clear
    assert found["b"].place_is_clear


@pytest.mark.parametrize(("quality", "is_clear"), [(0.88, False), (0.6, True)])
def test_a_free_place_that_fits_as_well_makes_it_unclear(quality, is_clear):
    item = looked_for("a", 0.0, a_guess(1.0, 0.9), a_guess(3.0, quality))
    assert claims([item])["a"].place_is_clear == is_clear


def test_another_yaw_that_fits_as_well_makes_it_unclear():
    turned = a_guess(1.0, 0.88, yaw_deg=90.0)
    assert not claims([looked_for("a", 0.0, a_guess(1.0, 0.9), turned)])["a"].yaw_is_clear
    slightly = a_guess(1.0, 0.88, yaw_deg=5.0)
    assert claims([looked_for("a", 0.0, a_guess(1.0, 0.9), slightly)])["a"].yaw_is_clear


def test_what_fits_badly_or_nowhere_stays_lost():
    assert claims([looked_for("a", 0.0, a_guess(1.0, 0.05)), looked_for("b", 0.0)]) == {}
    assert claims([]) == {}


def test_few_points_are_never_clear_by_a_little():
    assert a_guess(0.0, 0.9).is_clearly_better(a_guess(0.0, 0.7))
    assert not a_guess(0.0, 0.9, points=30).is_clearly_better(a_guess(0.0, 0.7, points=30))


@pytest.mark.parametrize(
    ("x", "z", "same"), [(0.4, 0.0, True), (0.5, 0.0, False), (0.4, 0.5, False)]
)
def test_two_things_on_one_height_keep_their_narrower_sides_apart(x, z, same):
    first, second = (a_model(name, radius_m=0.3, narrow_m=0.48) for name in "ab")
    here, there = Pose.from_yaw(0.0, (0.0, 0.0, 0.0)), Pose.from_yaw(0.0, (x, 0.0, z))
    assert is_same_spot(first, here, second, there) is same


@pytest.mark.parametrize(("support", "visible", "quality"), [(0.95, 1.0, 0.95), (0.7, 1.0, 0.4)])
def test_an_outline_better_than_any_wrong_ones_needs_no_colours(support, visible, quality):
    fit = SimpleNamespace(textured=False, support=support, visible_fraction=visible, quality=0.4)
    assert Guess(fit, None).quality == pytest.approx(quality)
