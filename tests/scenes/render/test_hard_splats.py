"""Whatever values splats hold: finite pictures, finite gradients, the reference's picture."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_COUNTS, SplatCloud

QUIET = settings(max_examples=40, deadline=None, derandomize=True, database=None)
SHAPES = {"means": (3,), "scales": (3,), "rotations": (4,), "opacities": ()}
TAME = {"means": (-1, 2), "scales": (1e-3, 0.5), "rotations": (-1, 1), "opacities": (0, 1)}


def values(low, high):
    """Mostly plausible numbers, else any bit pattern: NaN, infinite, denormal, huge, zero."""
    plausible = st.floats(low, high, width=32)
    return st.one_of(plausible, plausible, plausible, st.floats(width=32))


@st.composite
def clouds(draw):
    count = draw(st.integers(0, 6))
    arrays = {
        name: draw(hnp.arrays(np.float32, (count, *shape), elements=values(*_narrow(TAME[name]))))
        for name, shape in SHAPES.items()
    }
    bands = draw(st.sampled_from(SH_COUNTS[:2]))
    sh = draw(hnp.arrays(np.float32, (count, bands, 3), elements=values(-1, 1)))
    return SplatCloud(**arrays, sh=sh)


def _narrow(limits):
    return tuple(float(np.float32(limit)) for limit in limits)


CAMERAS = st.sampled_from(
    [
        Pinhole(9, 8, 1e7, 1e-3, 4.5, 4.0),
        Pinhole(9, 8, 20.0, 20.0, -1e7, 1e7),
        Fisheye(9, 8, 1e-3, 4.5, 4.0, np.pi),
        Pinhole(1, 1, 1.0, 1.0, 0.5, 0.5),
        Pinhole.from_fov(21, 18, 1.2),
        Fisheye.from_fov(1, np.pi),
        Fisheye.from_fov(19, np.radians(240)),
    ]
)


@QUIET
@given(cloud=clouds(), camera=CAMERAS, antialias=st.booleans())
def test_any_values_draw_a_finite_picture_that_is_the_references(cloud, camera, antialias):
    objects = [PosedSplats(cloud, Pose.identity())]
    here, options = Pose(np.eye(3), [0.0, 0.0, -0.5]), RenderOptions(antialias=antialias)
    with np.errstate(all="ignore"):
        oracle = ReferenceRenderer().render(objects, camera, here, options)
    for instructions in NativeRenderer().available_instructions():
        picture = NativeRenderer(instructions=instructions).render(objects, camera, here, options)
        assert np.isfinite(picture.rgb).all()
        assert np.isfinite(picture.depth).all()
        assert ((picture.alpha >= 0) & (picture.alpha <= 1)).all()
        assert np.abs(picture.alpha - oracle.alpha).max() <= 2e-4


@QUIET
@given(cloud=clouds(), camera=CAMERAS, portable=st.booleans())
def test_no_gradient_is_nan(cloud, camera, portable):
    here = Pose(np.eye(3), [0.0, 0.0, -0.5])
    shape = (camera.height_px, camera.width_px)
    ones = np.ones(shape, np.float32)
    recording = record(
        NativeRenderer(portable=portable), [PosedSplats(cloud, Pose.identity())], camera, here
    )
    (found,) = recording.gradients(np.ones((*shape, 3), np.float32), ones, ones).objects
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        assert getattr(found, name).shape == getattr(cloud, name).shape
        assert not np.isnan(getattr(found, name)).any()


@pytest.mark.parametrize("camera", [Pinhole.from_fov(24, 20, 1.0), Fisheye.from_fov(24, np.pi)])
def test_what_is_too_far_for_float32_is_not_drawn(renderer, ball, camera):
    for range_m, is_drawn in ((0.99e15, True), (1.01e15, False)):
        posed = PosedSplats(ball((0, 0, 1.0)), Pose(np.eye(3), [0.0, 0.0, range_m]))
        picture = renderer.render([posed], camera, Pose.identity())
        assert (picture.alpha.max() > 0.3) == is_drawn


def test_extremes_that_are_drawn_have_finite_gradients(native, ball):
    camera = Pinhole.from_fov(24, 20, 1.0)
    options = RenderOptions(background=(1e15, -1e15, 0.5))
    sh = np.full((1, 1, 3), 1e15, np.float32)
    near = ball((0, 0, 2.0), sigma_m=0.3)
    bright = SplatCloud(near.means, near.scales, near.rotations, near.opacities, sh)
    far = PosedSplats(ball((0, 0, 1.0)), Pose(np.eye(3), [0.0, 0.0, 0.99e15]))
    ones = np.ones((20, 24), np.float32)
    objects = [PosedSplats(bright, Pose.identity()), far]
    recording = record(native, objects, camera, Pose.identity(), options)
    for found in recording.gradients(np.ones((20, 24, 3), np.float32), ones, ones).objects:
        for name in ("means", "scales", "rotations", "opacities", "sh"):
            assert np.isfinite(getattr(found, name)).all()
        assert found.opacities.any()


@pytest.mark.parametrize("z", [-1e6, -3.0, -0.2, -1e-30, 0.0, 0.01])
def test_what_is_behind_a_pinhole_changes_nothing(renderer, ball, at_origin, z):
    camera, here = Pinhole.from_fov(24, 20, 1.0), Pose.identity()
    seen, behind = ball((0.1, 0.0, 2.0), sigma_m=0.3), ball((0.05, 0.1, z), sigma_m=0.5)
    alone = renderer.render(at_origin(seen), camera, here)
    both = renderer.render(at_origin(seen, behind), camera, here)
    np.testing.assert_array_equal(both.rgb, alone.rgb)
    np.testing.assert_array_equal(both.depth, alone.depth)


@pytest.mark.parametrize(
    ("field", "array", "got"),
    [
        ("means", np.zeros((1, 2), np.float32), r"float32 \(1, 2\)"),
        ("scales", np.zeros((2, 3), np.float32), r"float32 \(2, 3\)"),
        ("rotations", np.zeros((1, 4)), r"float64 \(1, 4\)"),
        ("opacities", np.zeros((1, 1), np.float32), r"float32 \(1, 1\)"),
        ("sh", np.zeros((1, 5, 3), np.float32), r"float32 \(1, 5, 3\)"),
        ("means", [[0.0, 0.0, 0.0]], "list"),
    ],
)
def test_gradients_name_a_wrong_array(ball, at_origin, field, array, got):
    cloud = ball((0, 0, 2.0))
    object.__setattr__(cloud, field, array)
    with pytest.raises(ValueError, match=rf"objects\[0\]\.cloud\.{field}: got {got}, wanted"):
        record(NativeRenderer(), at_origin(cloud), Pinhole.from_fov(8, 8, 1.0), Pose.identity())
