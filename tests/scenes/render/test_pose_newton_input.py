"""Odd input to the normal equations: never a crash, never a number that is silently wrong."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.pose_newton import (
    Brightness,
    PoseTarget,
    SolverOptions,
    normal_equations,
    solve_pose,
)
from scenes.render.reference.renderer import ReferenceRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud

HERE = Pose.identity()
POSE = Pose.from_yaw(0.2, (0.0, 0.0, 1.0))
COUNT = 40
ARRAYS = ("means", "scales", "rotations", "opacities", "sh")
ODD = st.sampled_from(
    [np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1e-45, 1e-38, 3e38, -3e38, 1e9, 1e3, 1e-9, 2.0]
)
CAMERAS = {
    "pinhole": Pinhole.from_fov(40, 30, 1.2),
    "fisheye": Fisheye.from_fov(40, 3.6),
    "one pixel": Pinhole.from_fov(1, 1, 1.2),
    "a tile and a column": Pinhole.from_fov(17, 16, 1.2),
}
RENDERERS = [
    NativeRenderer(instructions=name) for name in NativeRenderer().available_instructions()
]


def damage(*arrays):
    """Some values of 40 splats replaced: (array, splat, place, value)."""
    places = st.tuples(st.sampled_from(arrays), st.integers(0, COUNT - 1), st.integers(0, 11), ODD)
    return st.lists(places, max_size=25)


def damaged(cloud, places):
    arrays = {name: getattr(cloud, name).copy() for name in ARRAYS}
    for name, splat, place, value in places:
        row = arrays[name].reshape(COUNT, -1)
        row[splat, place % row.shape[1]] = value
    return SplatCloud(**arrays)


def target_of(camera, seed=0):
    shape = (camera.height_px, camera.width_px)
    pictures = np.random.default_rng(seed).uniform(0, 1, (5, *shape)).astype(np.float32)
    return PoseTarget(*pictures)


def assert_sound(equations):
    for value in (equations.jtj, equations.jtr, equations.cost, equations.grey, equations.alpha):
        assert np.isfinite(value).all()
    np.testing.assert_array_equal(equations.jtj, equations.jtj.T)
    assert (np.diag(equations.jtj) >= 0).all()
    assert equations.alpha.min() >= 0
    assert equations.alpha.max() <= 1


@settings(max_examples=60)
@given(
    places=damage("means", "scales", "rotations", "opacities"),
    kind=st.sampled_from(list(CAMERAS)),
    dof=st.sampled_from([3, 4, 6]),
    antialias=st.booleans(),
)
def test_odd_geometry_is_drawn_as_by_the_reference(wild_cloud, places, kind, dof, antialias):
    cloud = damaged(wild_cloud(COUNT, degree=1, seed=4, spread_m=0.5), places)
    posed, camera = PosedSplats(cloud, POSE), CAMERAS[kind]
    options = RenderOptions(antialias=antialias)
    oracle = ReferenceRenderer().render([posed], camera, HERE, options)
    for renderer in RENDERERS:
        equations = normal_equations(
            renderer,
            posed,
            camera,
            HERE,
            target_of(camera),
            degrees_of_freedom=dof,
            options=options,
        )
        assert_sound(equations)
        assert np.abs(equations.alpha - oracle.alpha).max() <= 2e-4


@given(places=damage(*ARRAYS), kind=st.sampled_from(list(CAMERAS)))
def test_odd_colours_are_summed_or_refused(wild_cloud, places, kind):
    cloud = damaged(wild_cloud(COUNT, degree=2, seed=5, spread_m=0.5), places)
    posed, camera = PosedSplats(cloud, POSE), CAMERAS[kind]
    refusals = []
    is_huge = np.abs(np.nan_to_num(cloud.sh, posinf=0, neginf=0)).max() > 1e6
    for renderer in RENDERERS:
        try:
            equations = normal_equations(renderer, posed, camera, HERE, target_of(camera))
        except ValueError as error:
            refusals.append(str(error))
        else:
            assert_sound(equations)
    assert all("sums are not finite" in refusal for refusal in refusals)
    assert is_huge or not refusals


@given(
    lost=st.sets(st.integers(0, COUNT - 1), max_size=COUNT),
    name=st.sampled_from(ARRAYS),
    kind=st.sampled_from(list(CAMERAS)),
)
def test_splats_without_a_value_change_no_bit_of_the_rest(wild_cloud, lost, name, kind):
    cloud = wild_cloud(COUNT, degree=1, seed=6, spread_m=0.5)
    places = [(name, splat, splat, np.nan) for splat in lost]
    kept = np.array([splat not in lost for splat in range(COUNT)])
    camera = CAMERAS[kind]
    for renderer in RENDERERS:
        got, wanted = (
            normal_equations(renderer, PosedSplats(some, POSE), camera, HERE, target_of(camera))
            for some in (damaged(cloud, places), cloud.select(kept))
        )
        for field in ("jtj", "jtr", "grey", "alpha"):
            np.testing.assert_array_equal(getattr(got, field), getattr(wanted, field))
        assert got.cost == wanted.cost


@pytest.mark.parametrize("kind", list(CAMERAS))
@pytest.mark.parametrize("where", ["no splats", "all behind", "all aside", "all damaged"])
def test_where_nothing_is_seen_only_costs_remain(native, wild_cloud, where, kind):
    cloud = wild_cloud(COUNT, degree=1, seed=7, spread_m=0.01)
    cloud = replace(cloud, scales=np.minimum(cloud.scales, np.float32(1e-3)))
    pose = {"all behind": (0.0, 0.0, -5.0), "all aside": (0.0, -50.0, -40.0)}.get(
        where, (0, 0, 2.0)
    )
    if where == "no splats":
        cloud = cloud.select(np.zeros(COUNT, dtype=bool))
    elif where == "all damaged":
        cloud = replace(cloud, means=np.full_like(cloud.means, np.inf))
    camera = CAMERAS[kind]
    target = target_of(camera)
    posed = PosedSplats(cloud, Pose(np.eye(3), pose))
    equations = normal_equations(native, posed, camera, HERE, target, solve_brightness=True)
    assert not equations.jtj.any()
    assert not equations.jtr.any()
    assert not equations.alpha.any()
    inside = np.ones(target.grey.shape, dtype=bool)
    if isinstance(camera, Fisheye):
        y, x = np.mgrid[: camera.height_px, : camera.width_px] + 0.5
        inside = np.hypot(x - camera.cx, y - camera.cy) <= camera.f_px * camera.max_angle
    wanted = (target.grey_weight * (target.background - target.grey) ** 2)[inside].sum()
    assert equations.grey_cost == pytest.approx(float(wanted), rel=1e-5)
    wanted = (target.silhouette_weight * target.silhouette**2)[inside].sum()
    assert equations.silhouette_cost == pytest.approx(float(wanted), rel=1e-5)
    solution = solve_pose(native, posed, camera, HERE, target, solver=SolverOptions(max_steps=3))
    np.testing.assert_array_equal(solution.world_from_object.translation, pose)


def test_sums_that_overflow_are_refused(native, ball):
    camera = CAMERAS["pinhole"]
    posed = PosedSplats(ball((0, 0, 2.0), sigma_m=0.3), HERE)
    bright = replace(target_of(camera), grey=np.full((30, 40), 1e30, np.float32))
    with pytest.raises(ValueError, match=r"sums are not finite .*target up to 1e\+30"):
        normal_equations(native, posed, camera, HERE, bright)
    with pytest.raises(ValueError, match=r"sums are not finite .*gain=1e\+30"):
        normal_equations(
            native, posed, camera, HERE, target_of(camera), brightness=Brightness(1e30, 0.0)
        )


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"twists": np.zeros((5, 6))}, ValueError, r"twists: \(5, 6\) values, wanted 3, 4 or 6"),
        ({"twists": np.zeros((2, 9))}, ValueError, r"twists: \(2, 9\) values, wanted 3, 4 or 6"),
        ({"twists": np.zeros((0, 6))}, ValueError, r"twists: \(0, 6\) values, wanted 3, 4 or 6"),
        ({"twists": np.zeros((6, 6), np.float32)}, TypeError, "twists"),
        ({"twists": np.zeros(36)}, TypeError, "twists"),
        ({"last": np.zeros(1199, np.float32)}, ValueError, r"target\[5\]: 1199 values"),
        ({"last": np.zeros(1200)}, TypeError, "target"),
        ({"last": np.zeros(2400, np.float32)[::2]}, TypeError, "contiguous"),
    ],
)
def test_the_kernel_refuses_wrong_arrays(native, wild_cloud, change, error, message):
    flat = [np.zeros(1200, np.float32) for _ in range(5)]
    with pytest.raises(error, match=message):
        native.pose_normals(
            PosedSplats(wild_cloud(COUNT, degree=1, seed=4), POSE),
            CAMERAS["pinhole"],
            HERE,
            RenderOptions(),
            twists=change.get("twists", np.zeros((6, 6))),
            target=(*flat, change.get("last", np.zeros(1200, np.float32))),
            luma=(0.3, 0.6, 0.1),
            brightness=(1.0, 0.0),
        )
