"""Places given to objects, each once."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.assignment import AssignmentCandidates, assign, is_same_spot
from tracking.hypotheses.hypothesis import Hypothesis
from tracking.model.templates import SMALL_PX, YAWS, Templates

PIXELS = SMALL_PX * SMALL_PX


def a_model(name, *, radius_m=0.5, narrow_m=0.3):
    """A model whose yaws all look different."""
    alpha = np.zeros((4, YAWS, PIXELS), np.float32)
    for yaw in range(YAWS):
        alpha[:, yaw, yaw * 40 : yaw * 40 + 40] = 1.0
    indistinguishable = np.arange(YAWS) == 0
    templates = Templates(alpha, np.zeros((*alpha.shape, 3), np.float32), indistinguishable)
    return SimpleNamespace(
        object_id=name,
        radius_m=radius_m,
        symmetry=1,
        templates=templates,
        source=SimpleNamespace(box_m=(narrow_m, 0.6, 0.6)),
    )


def a_hypothesis(x, score, *, yaw_deg=0.0, points=240):
    reduced = SimpleNamespace(contour=range(points))
    pose = Pose.from_yaw(math.radians(yaw_deg), (x, 0.0, 0.0))
    fit = SimpleNamespace(world_from_object=pose, score=score, reduced=reduced, textured=True)
    return Hypothesis(fit, None)


def looked_for(name, last_x, *fits):
    return AssignmentCandidates(a_model(name), Pose.from_yaw(0.0, (last_x, 0.0, 0.0)), fits)


def test_two_objects_never_get_one_place_and_the_total_counts():
    found = assign(
        [
            looked_for("a", 0.0, a_hypothesis(1.0, 0.9), a_hypothesis(3.0, 0.85)),
            looked_for("b", 0.0, a_hypothesis(1.01, 0.8)),
        ]
    )
    assert found["a"].hypothesis.world_from_object.translation[0] == pytest.approx(3.0)
    assert found["b"].hypothesis.world_from_object.translation[0] == pytest.approx(1.01)


@pytest.mark.parametrize("order", [1, -1])
def test_twins_get_the_places_nearest_to_their_last_ones(order):
    fits = (a_hypothesis(1.0, 0.9), a_hypothesis(3.0, 0.9))
    found = assign([looked_for("a", 2.6, *fits), looked_for("b", 1.3, *fits)][::order])
    assert found["a"].hypothesis.world_from_object.translation[0] == 3.0
    assert found["b"].hypothesis.world_from_object.translation[0] == 1.0
    assert found["a"].place_is_clear
    assert found["b"].place_is_clear


@pytest.mark.parametrize(("score", "is_clear"), [(0.88, False), (0.6, True)])
def test_a_free_place_that_fits_as_well_makes_it_unclear(score, is_clear):
    item = looked_for("a", 0.0, a_hypothesis(1.0, 0.9), a_hypothesis(3.0, score))
    assert assign([item])["a"].place_is_clear == is_clear


def test_another_yaw_that_fits_as_well_makes_it_unclear():
    turned = a_hypothesis(1.0, 0.88, yaw_deg=90.0)
    assert not assign([looked_for("a", 0.0, a_hypothesis(1.0, 0.9), turned)])["a"].yaw_is_clear
    slightly = a_hypothesis(1.0, 0.88, yaw_deg=5.0)
    assert assign([looked_for("a", 0.0, a_hypothesis(1.0, 0.9), slightly)])["a"].yaw_is_clear


def test_what_fits_badly_or_nowhere_stays_lost():
    assert assign([looked_for("a", 0.0, a_hypothesis(1.0, 0.05)), looked_for("b", 0.0)]) == {}
    assert assign([]) == {}


def test_few_points_are_never_clear_by_a_little():
    assert a_hypothesis(0.0, 0.9).is_clearly_better(a_hypothesis(0.0, 0.7))
    assert not a_hypothesis(0.0, 0.9, points=30).is_clearly_better(
        a_hypothesis(0.0, 0.7, points=30)
    )


@pytest.mark.parametrize(
    ("x", "z", "same"), [(0.4, 0.0, True), (0.5, 0.0, False), (0.4, 0.5, False)]
)
def test_two_objects_on_one_height_keep_their_narrower_sides_apart(x, z, same):
    first, second = (a_model(name, radius_m=0.3, narrow_m=0.48) for name in "ab")
    here, there = Pose.from_yaw(0.0, (0.0, 0.0, 0.0)), Pose.from_yaw(0.0, (x, 0.0, z))
    assert is_same_spot(first, here, second, there) is same


@pytest.mark.parametrize(
    ("contour_score", "visible", "score"), [(0.95, 1.0, 0.95), (0.7, 1.0, 0.4)]
)
def test_an_outline_better_than_any_wrong_ones_needs_no_colours(contour_score, visible, score):
    fit = SimpleNamespace(
        textured=False, contour_score=contour_score, visible_fraction=visible, score=0.4
    )
    assert Hypothesis(fit, None).score == pytest.approx(score)
