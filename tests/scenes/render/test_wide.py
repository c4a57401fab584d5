"""Splats drawn along rays: against the reference, and against EWA where both must agree."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import WIDE_RAD, PosedSplats, RenderOptions
from scenes.render.still import StillView
from scenes.splats import SplatCloud

HERE = Pose.identity()
EXACT = RenderOptions(exact_above_rad=WIDE_RAD, background=(0.2, 0.4, 0.6))
PARTS = ("rgb", "alpha", "depth", "ids")


def assert_same(rendering, wanted):
    for name in PARTS:
        np.testing.assert_array_equal(getattr(rendering, name), getattr(wanted, name), name)


def assert_agrees(rendering, oracle):
    for name in ("rgb", "alpha"):
        assert np.abs(getattr(rendering, name) - getattr(oracle, name)).max() <= 2e-4, name


@pytest.mark.parametrize("antialias", [False, True])
@pytest.mark.parametrize("spread_m", [1.0, 0.15])
def test_agrees_with_the_reference(native, reference, wild_cloud, camera, spread_m, antialias):
    """Around the eye, in front, at the sides and behind; from specks to fog."""
    objects = [
        PosedSplats(wild_cloud(90, degree=1, seed=k, spread_m=spread_m), Pose.from_yaw(0.3 * k))
        for k in range(2)
    ]
    options = RenderOptions(exact_above_rad=WIDE_RAD, antialias=antialias, near_m=0.02)
    rendering = native.render(objects, camera, HERE, options)
    oracle = reference.render(objects, camera, HERE, options)
    assert_agrees(rendering, oracle)
    assert np.mean(rendering.ids != oracle.ids) <= 1e-3
    by_ewa = native.render(objects, camera, HERE, RenderOptions(antialias=antialias, near_m=0.02))
    assert np.abs(by_ewa.rgb - oracle.rgb).max() > 1e-3


SIZES = st.floats(-4.0, 0.5).map(lambda power: 10.0**power)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(
    mean=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    scales=st.tuples(SIZES, SIZES, SIZES),
    rotation=st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    opacity=st.floats(0.004, 1.0),
    kind=st.sampled_from(["pinhole", "fisheye"]),
)
def test_one_splat_anywhere_agrees(mean, scales, rotation, opacity, kind):
    """A box too small for a splat would cut it off."""
    cloud = SplatCloud(
        np.array([mean], dtype=np.float32),
        np.array([scales], dtype=np.float32),
        np.array([rotation], dtype=np.float32),
        np.array([opacity], dtype=np.float32),
        np.zeros((1, 1, 3), dtype=np.float32),
    )
    camera = Pinhole.from_fov(70, 50, 1.4) if kind == "pinhole" else Fisheye.from_fov(80, 4.9)
    objects = [PosedSplats(cloud, HERE)]
    oracle = ReferenceRenderer().render(objects, camera, HERE, EXACT)
    for name in NativeRenderer().available_instructions():
        rendering = NativeRenderer(instructions=name).render(objects, camera, HERE, EXACT)
        assert_agrees(rendering, oracle)


def test_a_round_splat_far_off_axis_is_as_wide_as_ahead(renderer, ball):
    """The peak along a ray depends on its angle to the mean alone, which EWA gets wrong."""
    lens = Fisheye.from_fov(200, np.radians(200))
    sigma, range_m = 0.4, 2.0
    for angle in (0.0, 1.0, 1.6):
        mean = (range_m * math.sin(angle), 0.0, range_m * math.cos(angle))
        picture = renderer.render([PosedSplats(ball(mean, sigma_m=sigma), HERE)], lens, HERE, EXACT)
        rays = lens.unproject(np.column_stack([np.arange(200) + 0.5, np.full(200, 100.5)]))
        apart = np.arccos(np.clip(rays @ np.array(mean) / range_m, -1, 1))
        blurred = sigma**2 + 0.3 * (range_m / lens.f_px) ** 2
        sines = np.where(apart < np.pi / 2, np.sin(apart), 1.0)
        wanted = 0.8 * np.exp(-0.5 * (range_m * sines) ** 2 / blurred)
        seen = (wanted >= 1 / 255) & (np.abs(np.arange(200) - 99.5) < 99)
        np.testing.assert_allclose(picture.alpha[100][seen], wanted[seen], atol=2e-5)


def test_an_eye_inside_a_splat_is_in_a_fog(renderer, ball):
    lens = Fisheye.from_fov(80, np.radians(340))
    fog = ball((0.0, 0.0, 0.5), sigma_m=0.5, opacity=0.6)
    alpha = renderer.render([PosedSplats(fog, HERE)], lens, HERE, EXACT).alpha
    inside = np.hypot(*(np.mgrid[:80, :80] + 0.5 - 40.0)) < 39
    assert alpha[inside].min() == pytest.approx(0.6 * math.exp(-0.5), rel=2e-3)
    half_a_pixel = math.hypot(0.5, 0.5) / lens.f_px
    peak = 0.6 * math.exp(-0.5 * math.sin(half_a_pixel) ** 2)
    assert alpha.max() == pytest.approx(peak, rel=1e-3)


def test_small_splats_are_left_to_ewa(native, wild_cloud, camera):
    cloud = wild_cloud(300, seed=3)
    small = SplatCloud(
        cloud.means, cloud.scales * np.float32(0.02), cloud.rotations, cloud.opacities, cloud.sh
    )
    objects = [PosedSplats(small, Pose(np.eye(3), [0.0, 0.0, 4.0]))]
    assert_same(
        native.render(objects, camera, HERE, EXACT),
        native.render(objects, camera, HERE, RenderOptions(background=EXACT.background)),
    )


def test_threads_parts_and_still_views_change_no_bit(native, wild_cloud, camera):
    objects = [
        PosedSplats(wild_cloud(300, seed=k), Pose.from_yaw(k, (0.0, 0.0, 0.5))) for k in range(2)
    ]

    def options(**more):
        return RenderOptions(exact_above_rad=WIDE_RAD, background=EXACT.background, **more)

    whole = native.render(objects, camera, HERE, options(threads=1))
    assert_same(native.render(objects, camera, HERE, options(threads=3)), whole)
    part = native.render(objects, camera, HERE, options(region=(13, 21, 37, 30)))
    inside = (slice(21, 51), slice(13, 50))
    for name in PARTS:
        np.testing.assert_array_equal(getattr(part, name)[inside], getattr(whole, name)[inside])
    view = StillView(native, camera, world_from_camera=HERE, options=options())
    view.update(objects[:1])
    assert_same(view.update(objects).rendering, whole)


def test_gradients_refuse_what_they_do_not_have(native, ball, at_origin):
    camera = Pinhole.from_fov(20, 20, 1.0)
    with pytest.raises(ValueError, match=r"exact_above_rad: got .*, wanted inf"):
        record(native, at_origin(ball((0, 0, 2.0))), camera, HERE, EXACT)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan])
def test_a_bad_limit_is_named(renderer, bad):
    camera = Pinhole.from_fov(20, 20, 1.0)
    with pytest.raises(ValueError, match=r"options\.exact_above_rad: got .*, wanted "):
        renderer.render([], camera, HERE, RenderOptions(exact_above_rad=bad))
