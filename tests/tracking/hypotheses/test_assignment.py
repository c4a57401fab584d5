"""Places given to objects, each once, by log odds."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.assignment import AssignmentCandidates, assign, is_same_spot
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis, distinct
from tracking.likelihood.pixel_model import PoseSupport


def a_model(name, *, radius_m=0.5, narrow_m=0.3):
    """A model whose yaws all look different."""
    return SimpleNamespace(
        object_id=name,
        radius_m=radius_m,
        symmetry=1,
        are_same=lambda turns: np.abs(turns) < math.radians(7),
        source=SimpleNamespace(box_m=(narrow_m, 0.6, 0.6)),
    )


def a_hypothesis(x, nats, *, yaw_deg=0.0, log_prior=0.0):
    pose = Pose.from_yaw(math.radians(yaw_deg), (x, 0.0, 0.0))
    support = PoseSupport(nats, 10.0, 1.0, 0.5, 0.0, 900.0)
    return Hypothesis(SimpleNamespace(world_from_object=pose), support, log_prior)


def looked_for(name, *hypotheses):
    return AssignmentCandidates(a_model(name), hypotheses)


def test_two_objects_never_get_one_place_and_the_total_counts():
    found = assign(
        [
            looked_for("a", a_hypothesis(1.0, 9.0), a_hypothesis(3.0, 8.5)),
            looked_for("b", a_hypothesis(1.01, 8.0)),
        ]
    )
    assert found["a"].hypothesis.world_from_object.translation[0] == pytest.approx(3.0)
    assert found["b"].hypothesis.world_from_object.translation[0] == pytest.approx(1.01)


@pytest.mark.parametrize("order", [1, -1])
def test_twins_get_the_places_that_the_prior_prefers(order):
    def twin(name, near_one, near_three):
        first = a_hypothesis(1.0, 9.0, log_prior=near_one)
        second = a_hypothesis(3.0, 9.0, log_prior=near_three)
        return looked_for(name, first, second)

    found = assign([twin("a", -0.3, -0.1), twin("b", -0.1, -0.3)][::order])
    assert found["a"].hypothesis.world_from_object.translation[0] == 3.0
    assert found["b"].hypothesis.world_from_object.translation[0] == 1.0
    assert found["a"].place_probability > 0.99


def test_the_posterior_counts_free_places_and_being_nowhere_in_view():
    sure = assign([looked_for("a", a_hypothesis(1.0, 9.0), a_hypothesis(3.0, 2.0))])["a"]
    assert sure.place_probability == pytest.approx(1.0, abs=2e-3)
    even = assign([looked_for("a", a_hypothesis(1.0, 9.0), a_hypothesis(3.0, 9.0))])["a"]
    assert even.place_probability == pytest.approx(0.5, abs=1e-3)
    weak = assign([looked_for("a", a_hypothesis(1.0, 1.0))])["a"]
    assert weak.place_probability == pytest.approx(math.e / (math.e + 1.0))


def test_another_yaw_shares_the_pose_but_not_the_place():
    turned = a_hypothesis(1.0, 8.0, yaw_deg=90.0)
    found = assign([looked_for("a", a_hypothesis(1.0, 9.0), turned)])["a"]
    assert found.rival_nats == pytest.approx(1.0)
    assert found.place_probability == pytest.approx(1.0, abs=1e-3)
    assert found.pose_probability == pytest.approx(math.e / (math.e + 1.0), abs=1e-3)
    slightly = a_hypothesis(1.0, 8.0, yaw_deg=5.0)
    found = assign([looked_for("a", a_hypothesis(1.0, 9.0), slightly)])["a"]
    assert found.rival_nats == math.inf
    assert found.pose_probability == pytest.approx(1.0, abs=1e-3)


def test_what_is_likelier_nowhere_in_view_stays_lost():
    assert assign([looked_for("a", a_hypothesis(1.0, 3.0, log_prior=-4.0)), looked_for("b")]) == {}
    assert assign([]) == {}


def test_only_clear_odds_are_clear_and_equal_poses_are_one():
    best, other = a_hypothesis(0.0, 9.0), a_hypothesis(0.05, 9.0 - CLEAR_NATS + 0.1)
    assert not best.is_clearly_better(other)
    assert best.is_clearly_better(a_hypothesis(0.0, 9.0 - CLEAR_NATS - 0.1))
    assert distinct(a_model("a"), [other, best]) == [best]
    assert len(distinct(a_model("a"), [best, a_hypothesis(0.4, 1.0)])) == 2


@pytest.mark.parametrize(
    ("x", "z", "same"), [(0.4, 0.0, True), (0.5, 0.0, False), (0.4, 0.3, True), (0.4, 0.6, False)]
)
def test_objects_do_not_stand_in_each_other_but_on_each_other(x, z, same):
    first, second = (a_model(name, radius_m=0.3, narrow_m=0.48) for name in "ab")
    here, there = Pose.from_yaw(0.0, (0.0, 0.0, 0.0)), Pose.from_yaw(0.0, (x, 0.0, z))
    assert is_same_spot(first, here, second, there) is same
    assert is_same_spot(second, there, first, here) is same
