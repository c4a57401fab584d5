"""The native renderer against the reference, and what is its own: threads, cache, damage."""

import pickle
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render import native as native_module
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud

HERE = Pose.identity()


def assert_agrees(rendering, oracle):
    """Within 2e-4 at every pixel; the 1/255 step included, since doubtful samples are judged."""
    for name in ("rgb", "alpha"):
        error = np.abs(getattr(rendering, name) - getattr(oracle, name))
        assert error.max() <= 2e-4, name
    hit = oracle.alpha > 0
    relative = np.abs(rendering.depth[hit] / oracle.depth[hit] - 1)
    assert relative.max(initial=0.0) <= 1e-3
    assert not rendering.depth[~hit].any()
    # Two objects of almost equal weight may change places.
    assert np.mean(rendering.ids != oracle.ids) <= 1e-3


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize("antialias", [False, True])
def test_agrees_with_the_reference(native, reference, wild_cloud, camera, degree, antialias):
    objects = [
        PosedSplats(wild_cloud(150, degree=degree, seed=1), Pose.from_yaw(0.3, (0.1, 0.2, 1.5))),
        PosedSplats(
            wild_cloud(100, degree=3, seed=2),
            Pose.from_quaternion(np.array([0.5, 0.5, -0.5, 0.5]), (0.5, 0.0, 0.5)),
        ),
        PosedSplats(wild_cloud(50, degree=1, seed=3, spread_m=0.2), Pose.identity()),
    ]
    pose = Pose.from_yaw(-0.2, (0.0, 0.0, -0.7))
    options = RenderOptions(background=(0.2, 0.4, 0.6), sh_degree=degree, antialias=antialias)
    rendering = native.render(objects, camera, pose, options)
    oracle = reference.render(objects, camera, pose, options)
    assert_agrees(rendering, oracle)
    assert oracle.alpha.mean() > 0.2


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_drawn_beside_the_reach(native, reference, wild_cloud, camera, seed):
    placed = Pose.from_yaw(0.3, (0.4, -0.2, 3.0))
    objects = [PosedSplats(wild_cloud(40, degree=0, seed=seed, spread_m=0.2), placed)]
    options = RenderOptions(antialias=True)
    shown = reference.render(objects, camera, HERE, options).alpha > 0
    rows, columns = native.reach(objects, camera, HERE, options)
    assert shown.any()
    assert shown[rows, columns].sum() == shown.sum()
    away = [PosedSplats(objects[0].cloud, Pose.from_yaw(0.0, (0.0, 0.0, -2000.0)))]
    beyond = RenderOptions(near_m=5000.0)
    assert native.reach(away, camera, HERE, beyond) is None


@pytest.mark.parametrize("seed", range(4))
def test_agrees_inside_a_cloud_of_near_splats(native, reference, wild_cloud, camera, seed):
    cloud = wild_cloud(200, degree=1, seed=seed, spread_m=0.15)
    objects = [PosedSplats(cloud, Pose.identity())]
    options = RenderOptions(near_m=0.01)
    assert_agrees(
        native.render(objects, camera, HERE, options),
        reference.render(objects, camera, HERE, options),
    )


def test_agrees_on_a_large_picture(native, reference, wild_cloud):
    objects = [PosedSplats(wild_cloud(60, seed=9, spread_m=0.7), Pose.identity())]
    pose = Pose(np.eye(3), [0.0, 0.0, -3.0])
    for camera in (Pinhole.from_fov(1000, 620, 0.8), Fisheye.from_fov(900, np.radians(200))):
        assert_agrees(native.render(objects, camera, pose), reference.render(objects, camera, pose))


def test_agrees_far_along_needles(native, reference):
    """Slanted threads across a large picture: their terms cancel to a thousandth there."""
    rng = np.random.default_rng(8)
    count = 12
    angles = rng.uniform(0.2, 1.3, count)
    rotations = np.zeros((count, 4))
    rotations[:, 0], rotations[:, 3] = np.cos(angles / 2), np.sin(angles / 2)
    cloud = SplatCloud(
        np.concatenate([rng.uniform(-1, 1, (count, 2)), np.full((count, 1), 2.0)], axis=1).astype(
            np.float32
        ),
        np.tile(np.array([[3.0, 1e-4, 1e-4]], dtype=np.float32), (count, 1)),
        rotations.astype(np.float32),
        np.full(count, 0.9, dtype=np.float32),
        np.zeros((count, 1, 3), dtype=np.float32),
    )
    camera = Pinhole(1500, 1200, 1500.0, 1500.0, 700.0, 650.0)
    objects = [PosedSplats(cloud, Pose.identity())]
    rendering = native.render(objects, camera, HERE)
    oracle = reference.render(objects, camera, HERE)
    assert np.abs(rendering.alpha - oracle.alpha).max() <= 2e-5


def test_no_sample_falls_on_the_wrong_side_of_the_step(native, reference, wild_cloud):
    """Thousands of samples lie so near to 1/255 that float32 alone would misplace some."""
    cloud = wild_cloud(150, seed=21, spread_m=0.6)
    faint = SplatCloud(
        cloud.means,
        np.maximum(cloud.scales, 0.3),
        cloud.rotations,
        np.linspace(0.0045, 0.02, 150, dtype=np.float32),
        cloud.sh,
    )
    objects = [PosedSplats(faint, Pose.identity())]
    pose = Pose(np.eye(3), [0.0, 0.0, -3.0])
    camera = Pinhole.from_fov(700, 500, 1.0)
    rendering = native.render(objects, camera, pose)
    assert np.abs(rendering.alpha - reference.render(objects, camera, pose).alpha).max() <= 2e-5


def test_agrees_on_splats_of_equal_depth(native, reference, wild_cloud):
    def sheet(seed):
        cloud = wild_cloud(80, seed=seed, spread_m=0.4)
        means = cloud.means.copy()
        means[:, 2] = 2.0
        return SplatCloud(
            means, np.maximum(cloud.scales, 0.1), cloud.rotations, cloud.opacities, cloud.sh
        )

    objects = [PosedSplats(sheet(seed), Pose.identity()) for seed in (1, 2)]
    camera = Pinhole.from_fov(60, 50, 0.6)
    assert_agrees(native.render(objects, camera, HERE), reference.render(objects, camera, HERE))


def test_agrees_where_only_tails_reach_the_picture(native, reference, wild_cloud, camera):
    """Many chunks, most of them outside: none that still touches the border may be dropped."""
    cloud = wild_cloud(4000, seed=13, spread_m=1.5)
    rng = np.random.default_rng(5)
    fuzzy = SplatCloud(
        cloud.means,
        rng.uniform(0.05, 0.15, (4000, 3)).astype(np.float32),
        cloud.rotations,
        np.full(4000, 0.02, dtype=np.float32),
        cloud.sh,
    )
    objects = [PosedSplats(fuzzy, Pose.identity())]
    pose = Pose(np.eye(3), [0.0, 0.0, -1.5])
    assert_agrees(native.render(objects, camera, pose), reference.render(objects, camera, pose))


def test_agrees_where_tiles_saturate(native, reference, wild_cloud):
    cloud = wild_cloud(1500, seed=11, spread_m=0.3)
    objects = [PosedSplats(cloud, Pose.identity())]
    camera = Pinhole.from_fov(60, 60, 0.3)
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    oracle = reference.render(objects, camera, pose)
    assert oracle.alpha.min() > 0.9998
    rendering = native.render(objects, camera, pose)
    assert np.abs(rendering.alpha - oracle.alpha).max() <= 2e-4
    assert np.abs(rendering.rgb - oracle.rgb).max() <= 2e-4


def test_the_number_of_threads_changes_nothing(native, wild_cloud, camera):
    objects = [PosedSplats(wild_cloud(3000, degree=2, seed=k), Pose.from_yaw(k)) for k in range(2)]
    pose = Pose(np.eye(3), [0.0, 0.0, -1.0])
    one = native.render(objects, camera, pose, RenderOptions(threads=1))
    for threads in (0, 2, 3, 8):
        many = native.render(objects, camera, pose, RenderOptions(threads=threads))
        for name in ("rgb", "alpha", "depth", "ids"):
            np.testing.assert_array_equal(getattr(many, name), getattr(one, name))


def test_wider_vectors_change_nothing(wild_cloud, camera):
    available = NativeRenderer().available_instructions()
    if available[-2:] != ("avx2", "avx512"):
        pytest.skip("this machine has vectors of one width only")
    objects = [PosedSplats(wild_cloud(2000, degree=2, seed=k), Pose.from_yaw(k)) for k in range(2)]
    pose = Pose(np.eye(3), [0.0, 0.0, -1.0])
    narrow, wide = (
        NativeRenderer(instructions=name).render(objects, camera, pose) for name in available[-2:]
    )
    for name in ("rgb", "alpha", "depth", "ids"):
        np.testing.assert_array_equal(getattr(wide, name), getattr(narrow, name))


def test_instructions_can_be_chosen():
    available = NativeRenderer().available_instructions()
    assert available[0] == NativeRenderer(portable=True).instructions == "scalar"
    assert available[-1] == NativeRenderer().instructions
    for name in available:
        assert NativeRenderer(instructions=name).instructions == name
    with pytest.raises(ValueError, match=r'instructions: got "abacus", wanted .*scalar'):
        NativeRenderer(instructions="abacus")


def test_another_process_has_one_renderer_of_the_same_instructions(native):
    there = pickle.loads(pickle.dumps(native))
    assert there.instructions == native.instructions
    assert there is not native
    assert pickle.loads(pickle.dumps(native)) is there


def test_several_callers_at_once(native, wild_cloud, at_origin, camera):
    scenes = [at_origin(wild_cloud(500, seed=seed)) for seed in range(6)]
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    alone = [native.render(objects, camera, pose).rgb for objects in scenes]
    with ThreadPoolExecutor(4) as callers:
        together = list(callers.map(lambda objects: native.render(objects, camera, pose), scenes))
    for before, after in zip(alone, together, strict=True):
        np.testing.assert_array_equal(after.rgb, before)


BAD_FLOATS = st.sampled_from(
    [np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1e-45, 1e-38, 3e38, -3e38, 1e9, 1e3, 1e-9, 2.0]
)
DAMAGE = st.lists(
    st.tuples(
        st.sampled_from(["means", "scales", "rotations", "opacities", "sh"]),
        st.integers(0, 39),
        st.integers(0, 11),
        BAD_FLOATS,
    ),
    max_size=25,
)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(damage=DAMAGE, kind=st.sampled_from(["pinhole", "fisheye"]), antialias=st.booleans())
def test_damaged_splats_are_left_out(wild_cloud, damage, kind, antialias):
    arrays = {
        name: getattr(wild_cloud(40, degree=1, seed=4, spread_m=0.5), name).copy()
        for name in ("means", "scales", "rotations", "opacities", "sh")
    }
    for name, splat, place, value in damage:
        row = arrays[name].reshape(40, -1)
        row[splat, place % row.shape[1]] = value
    objects = [PosedSplats(SplatCloud(**arrays), Pose(np.eye(3), [0.0, 0.0, 1.0]))]
    camera = Pinhole.from_fov(40, 30, 1.2) if kind == "pinhole" else Fisheye.from_fov(40, 3.6)
    options = RenderOptions(antialias=antialias)
    oracle = ReferenceRenderer().render(objects, camera, HERE, options)
    for instructions in NativeRenderer().available_instructions():
        renderer = NativeRenderer(instructions=instructions)
        rendering = renderer.render(objects, camera, HERE, options)
        assert np.isfinite(rendering.rgb).all()
        assert np.abs(rendering.alpha - oracle.alpha).max() <= 2e-4


def test_non_unit_quaternions_count_as_their_direction(native, wild_cloud, at_origin, camera):
    cloud = wild_cloud(50, seed=6)
    scaled = SplatCloud(
        cloud.means, cloud.scales, cloud.rotations * 64.0, cloud.opacities, cloud.sh
    )
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    np.testing.assert_array_equal(
        native.render(at_origin(scaled), camera, pose).rgb,
        native.render(at_origin(cloud), camera, pose).rgb,
    )


def test_prepare_counts_the_damaged(native, wild_cloud):
    cloud = wild_cloud(20)
    scales = cloud.scales.copy()
    scales[3, 1] = 0.0
    scales[7, 2] = np.nan
    sh = cloud.sh.copy()
    sh[4], sh[5] = 1e15, 1.1e15
    damaged = SplatCloud(cloud.means, scales, cloud.rotations, cloud.opacities, sh)
    assert native.prepare(cloud) == 0
    assert native.prepare(damaged) == 3


def test_a_cloud_is_prepared_once_and_old_ones_are_forgotten(wild_cloud, at_origin, monkeypatch):
    renderer = NativeRenderer()
    prepared = []
    prepare = renderer._prepare
    monkeypatch.setattr(renderer, "_prepare", lambda *a: (prepared.append(1), prepare(*a))[1])
    monkeypatch.setattr(native_module, "KEPT_CLOUDS", 3)
    camera = Pinhole.from_fov(8, 8, 1.0)
    clouds = [wild_cloud(5, seed=seed) for seed in range(4)]
    for cloud in (clouds[0], clouds[0], clouds[1], clouds[2], clouds[0]):
        renderer.render(at_origin(cloud), camera, HERE)
    assert len(prepared) == 3
    renderer.render(at_origin(clouds[3]), camera, HERE)
    renderer.render(at_origin(clouds[0]), camera, HERE)
    assert len(prepared) == 4
    renderer.render(at_origin(clouds[1]), camera, HERE)
    assert len(prepared) == 5


def test_a_missing_crate_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "scenes._native", None)
    monkeypatch.delattr("scenes._native", raising=False)
    with pytest.raises(ImportError, match=r"\./nexus"):
        NativeRenderer()


def test_too_large_a_picture_is_refused(native):
    with pytest.raises(ValueError, match=r"camera: 40000×1 px, wanted at most 32768"):
        native.render([], Pinhole(40000, 1, 1.0, 1.0, 0.0, 0.0), HERE)


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (Pinhole(8, 8, 2e7, 9.0, 4.0, 4.0), r"focal length \(20000000.0, 9.0\) px, wanted 0.001"),
        (Pinhole(8, 8, 9.0, 9e-4, 4.0, 4.0), r"focal length \(9.0, 0.0009\) px, wanted 0.001 to"),
        (Fisheye(8, 8, 2e7, 4.0, 4.0, 1.0), r"focal length \(20000000.0,\) px, wanted 0.001 to"),
        (Pinhole(8, 8, 9.0, 9.0, -2e7, 4.0), r"centre \(-20000000.0, 4.0\) px, wanted finite"),
        (Pinhole(8, 8, 9.0, 9.0, 4.0, np.nan), r"centre \(4.0, nan\) px, wanted finite"),
    ],
)
def test_cameras_beyond_float32_are_refused(renderer, camera, message):
    with pytest.raises(ValueError, match=f"camera: {message}"):
        renderer.render([], camera, Pose.identity())
