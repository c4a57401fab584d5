"""The native likelihood and its numpy twin say the same of any pictures."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.pose import Pose
from tests.twins import likelihood
from tracking.evidence.observation import observation_of, observe
from tracking.likelihood.drawn_object import draw_object
from tracking.likelihood.pixel_model import EXACTLY, NOT_IN_VIEW, ROUGHLY
from tracking.likelihood.pose_likelihood import pose_support

NATS = 2e-3
"""Largest difference in nats, relative to the samples a silhouette is worth: powers and logarithms
of the kernel are right to five digits."""


def assert_same(observation, model, pose, renderer, *, tolerance=EXACTLY, is_coarse=False):
    native = pose_support(
        observation, model, pose, renderer, tolerance=tolerance, is_coarse=is_coarse
    )
    drawn = draw_object(observation, model, pose, renderer, is_coarse=is_coarse)
    if drawn is None:
        assert native == NOT_IN_VIEW
        return native
    terms = likelihood.terms_of(observation, model, pose, tolerance)
    twin = likelihood.support_of(observation, drawn, terms)
    assert native.area_px == pytest.approx(twin.area_px, rel=1e-5)
    assert native.open_fraction == pytest.approx(twin.open_fraction, rel=1e-4, abs=1e-6)
    assert native.samples == pytest.approx(twin.samples, rel=1e-4)
    assert native.matched_fraction == pytest.approx(twin.matched_fraction, rel=1e-3, abs=1e-5)
    assert native.nats == pytest.approx(twin.nats, rel=1e-3, abs=NATS * max(twin.samples, 1.0))
    return native


def at_random(observation, seed, *, in_any_light):
    """The window with random pictures in it."""
    rng = np.random.default_rng(seed)
    shape = observation.changed.shape

    def picture(*channels):
        return rng.random((*shape, *channels), dtype=np.float32)

    live = picture(3)
    return observation_of(
        live,
        np.clip(live + 0.3 * (picture(3) - 0.5), 0.0, 1.0).astype(np.float32),
        np.clip(live + 0.3 * (picture(3) - 0.5), 0.0, 1.0).astype(np.float32),
        picture(),
        hidden=(picture() > 0.7) * picture(),
        claimed=(picture() > 0.8) * picture(),
        range_m=3.0 * picture() * (picture() > 0.2),
        camera=observation.camera,
        world_from_camera=observation.world_from_camera,
        lens_px=2,
        in_any_light=in_any_light,
    )


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from(["book-1", "mug-1", "box-1"]),
    shrink=st.sampled_from([1, 2, 5]),
    step_m=st.tuples(*3 * [st.floats(-0.3, 0.3)]),
    turn_rad=st.floats(-math.pi, math.pi),
    tolerance=st.sampled_from([EXACTLY, ROUGHLY]),
    is_coarse=st.booleans(),
    in_any_light=st.booleans(),
)
def test_random_pictures(
    table, as_scanned, seed, name, shrink, step_m, turn_rad, tolerance, is_coarse, in_any_light
):
    model, true = table.models[name], table.poses[name]
    window = observe(as_scanned, table.evidence(as_scanned, name, true)).shrunk(shrink)
    pose = Pose.from_yaw(true.yaw() + turn_rad, true.translation + np.array(step_m))
    observation = at_random(window, seed, in_any_light=in_any_light)
    assert_same(observation, model, pose, table.renderer, tolerance=tolerance, is_coarse=is_coarse)


@pytest.mark.parametrize("name", ["book-1", "mug-1", "box-1"])
@pytest.mark.parametrize("tolerance", [EXACTLY, ROUGHLY])
@pytest.mark.parametrize("shrink", [1, 2, 5])
def test_filmed_objects(table, as_scanned, name, tolerance, shrink):
    model, true = table.models[name], table.poses[name]
    observation = observe(as_scanned, table.evidence(as_scanned, name, true)).shrunk(shrink)
    for offset_m in (0.0, 0.02, 0.1):
        pose = Pose(true.rotation, true.translation + np.array([offset_m, 0.0, 0.0]))
        support = assert_same(observation, model, pose, table.renderer, tolerance=tolerance)
        assert support.area_px > 4.0


def test_what_is_hidden_says_nothing(table, as_scanned):
    model, true = table.models["mug-1"], table.poses["mug-1"]
    observation = observe(as_scanned, table.evidence(as_scanned, "mug-1", true))
    hidden = replace(observation, hidden=np.ones_like(observation.hidden))
    assert assert_same(hidden, model, true, table.renderer).nats == 0.0
