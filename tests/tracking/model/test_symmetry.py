"""Symmetry is found from the scan: of shapes and prints, whatever light they were scanned in."""

import math

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.splats import SH_C0, SplatCloud
from scenes.state import ObjectModel
from tracking.model.object_model import make_model
from tracking.model.symmetry import ROUND, SAME_NATS, are_same, symmetry_of

COUNT = 5000
YAWS = 24


def standing(means, colours, name="it"):
    """A scan of small splats on a surface."""
    count = len(means)
    splats = SplatCloud(
        means.astype(np.float32),
        np.full((count, 3), 0.008, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.95, np.float32),
        ((colours - 0.5) / SH_C0)[:, None, :].astype(np.float32),
    )
    size = np.ptp(means, axis=0)
    return ObjectModel(name, name, "", splats, tuple(size.tolist()), 0.0, Pose.identity())


def cylinder(paint):
    """A closed cylinder whose side has a colour that depends on the azimuth."""
    rng = np.random.default_rng(1)
    azimuth = rng.uniform(-math.pi, math.pi, 2 * COUNT)
    is_side = np.arange(2 * COUNT) < COUNT
    radius = np.where(is_side, 0.15, 0.15 * np.sqrt(rng.uniform(size=2 * COUNT)))
    height = np.where(is_side, rng.uniform(0.0, 0.4, 2 * COUNT), 0.4)
    means = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=1)
    colours = np.where(is_side, paint(azimuth), 0.5)
    return standing(means, colours[:, None] * np.ones(3))


def plain(azimuth):
    return np.full(len(azimuth), 0.5)


def lit_from_one_side(azimuth):
    return 0.5 + 0.08 * np.cos(azimuth)


def striped(azimuth):
    return np.where(np.abs(azimuth) < 0.25, 0.9, 0.4)


def three_stripes(azimuth):
    return 0.6 + 0.3 * np.cos(3 * azimuth)


@pytest.mark.parametrize(
    ("paint", "symmetry"), [(plain, ROUND), (lit_from_one_side, ROUND), (striped, 1)]
)
def test_a_cylinder_is_round_unless_something_is_printed_on_it(paint, symmetry):
    assert make_model(cylinder(paint), NativeRenderer()).symmetry == symmetry


def test_a_print_that_repeats_is_an_n_fold_symmetry():
    model = make_model(cylinder(three_stripes), NativeRenderer())
    assert model.symmetry == 3
    assert model.are_same(np.radians([0.0, 120.0, 240.0, -120.0])).all()
    assert not model.are_same(np.radians([60.0, 180.0])).any()


def test_symmetry_is_the_finest_turn_that_nobody_sees():
    nats = np.full(YAWS, 1.0)
    nats[0] = 0.0
    assert symmetry_of(nats) == 1
    nats[[6, 12, 18]] = 0.5 * SAME_NATS
    assert symmetry_of(nats) == 4
    assert symmetry_of(np.zeros(YAWS)) == ROUND
    np.testing.assert_array_equal(
        are_same(nats, np.radians([0.0, 91.0, 45.0])), [True, True, False]
    )
