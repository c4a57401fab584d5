"""The native likelihood and its numpy twin say the same of any pictures."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tests.twins import likelihood
from tracking.evidence.observation import observation_of, observe
from tracking.likelihood import pose_likelihood
from tracking.likelihood.drawn_object import DrawnObject, draw_object
from tracking.likelihood.pixel_model import EXACTLY, ROUGHLY, Terms

NATS = 2e-3
"""Largest difference in nats, relative to the samples a silhouette is worth: powers and logarithms
of the kernel are right to five digits."""


def assert_same(observation, drawn, terms):
    native = pose_likelihood.support_of(observation, drawn, terms)
    twin = likelihood.support_of(observation, drawn, terms)
    assert native.area_px == pytest.approx(twin.area_px, rel=1e-5)
    assert native.open_fraction == pytest.approx(twin.open_fraction, rel=1e-4, abs=1e-6)
    assert native.samples == pytest.approx(twin.samples, rel=1e-4)
    assert native.matched_fraction == pytest.approx(twin.matched_fraction, rel=1e-3, abs=1e-5)
    assert native.nats == pytest.approx(twin.nats, rel=1e-3, abs=NATS * max(twin.samples, 1.0))
    return native


def random_case(seed, size, part, *, finer, in_any_light):
    """Random pictures of a window, and of an object drawn in a part of it."""
    rng = np.random.default_rng(seed)
    width, height = size

    def picture(*shape):
        return rng.random(shape, dtype=np.float32)

    def window(*channels):
        return picture(height, width, *channels)

    live = window(3)
    observation = observation_of(
        live,
        np.clip(live + 0.3 * (window(3) - 0.5), 0.0, 1.0).astype(np.float32),
        np.clip(live + 0.3 * (window(3) - 0.5), 0.0, 1.0).astype(np.float32),
        window(),
        hidden=(window() > 0.7) * window(),
        claimed=(window() > 0.8) * window(),
        range_m=3.0 * window() * (window() > 0.2),
        camera=Fisheye.from_fov(max(size), 1.0),
        world_from_camera=Pose.identity(),
        lens_px=2,
        in_any_light=in_any_light,
    )
    rows, columns = part
    shape = finer * (rows.stop - rows.start), finer * (columns.stop - columns.start)
    alpha = np.clip(1.5 * picture(*shape), 0.0, 1.0)

    def drawn(rgb):
        ids = np.zeros(shape, np.int32)
        return Rendering((alpha[..., None] * rgb).astype(np.float32), alpha, depth, ids)

    depth = 3.0 * picture(*shape)
    pictures = DrawnObject(part, finer, drawn(picture(*shape, 3)), drawn(picture(*shape, 3)))
    return observation, pictures


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    width=st.integers(2, 40),
    height=st.integers(2, 40),
    left=st.integers(0, 9),
    top=st.integers(0, 9),
    finer=st.sampled_from([1, 2]),
    ring_px=st.integers(1, 30),
    reach_px=st.floats(1.0, 60.0),
    tolerance=st.sampled_from([EXACTLY, ROUGHLY]),
    in_any_light=st.booleans(),
)
def test_random_pictures(
    seed, width, height, left, top, finer, ring_px, reach_px, tolerance, in_any_light
):
    size = width + left + 3, height + top + 1
    part = slice(top, top + height), slice(left, left + width)
    case = random_case(seed, size, part, finer=finer, in_any_light=in_any_light)
    assert_same(*case, Terms(tolerance, ring_px, reach_px, 9.0))


@pytest.mark.parametrize("name", ["book-1", "mug-1", "box-1"])
@pytest.mark.parametrize("tolerance", [EXACTLY, ROUGHLY])
@pytest.mark.parametrize("shrink", [1, 2, 5])
def test_filmed_objects(table, as_scanned, name, tolerance, shrink):
    model, true = table.models[name], table.poses[name]
    observation = observe(as_scanned, table.evidence(as_scanned, name, true)).shrunk(shrink)
    for offset_m in (0.0, 0.02, 0.1):
        pose = Pose(true.rotation, true.translation + np.array([offset_m, 0.0, 0.0]))
        drawn = draw_object(observation, model, pose, table.renderer)
        terms = pose_likelihood.terms_of(observation, model, pose, tolerance)
        support = assert_same(observation, drawn, terms)
        assert support.area_px > 4.0


def test_what_is_hidden_says_nothing(table, as_scanned):
    model, true = table.models["mug-1"], table.poses["mug-1"]
    observation = observe(as_scanned, table.evidence(as_scanned, "mug-1", true))
    hidden = replace(observation, hidden=np.ones_like(observation.hidden))
    drawn = draw_object(hidden, model, true, table.renderer)
    terms = pose_likelihood.terms_of(hidden, model, true, EXACTLY)
    assert assert_same(hidden, drawn, terms).nats == 0.0


def test_a_part_beyond_the_window_is_refused():
    part = slice(0, 5), slice(0, 5)
    observation, drawn = random_case(1, (8, 8), part, finer=1, in_any_light=False)
    outside = replace(drawn, part=(slice(4, 9), slice(0, 5)))
    with pytest.raises(ValueError, match="part"):
        pose_likelihood.support_of(observation, outside, Terms(EXACTLY, 1, 4.0, 9.0))
