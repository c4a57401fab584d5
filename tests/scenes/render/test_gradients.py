"""Gradients against float64 differences of a picture whose mask and order are frozen."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud
from tests.scenes.render.frozen_scene import (
    VALUES,
    FrozenScene,
    assert_steps_agree,
    assert_values_agree,
)

CAMERA_POSE = Pose(np.eye(3), [0.1, 0.2, -1.0])
POSES = (
    Pose.from_yaw(0.3, (0.1, 0.2, 1.5)),
    Pose.from_quaternion(np.array([0.5, 0.5, -0.5, 0.5]), (0.3, 0.1, 1.0)),
)
TOLERANCE = 1e-4
"""Of the norm of a splat's gradient, or of a hundredth of the largest splat's (ten roundings)."""
POSE_TOLERANCE = 5e-6


def scene_and_gradients(native, drawn_cloud, camera, options, *, seed):
    """Two objects with a loss that is linear in the picture, and what the kernels say of it."""
    objects = [
        drawn_cloud(pose, camera, CAMERA_POSE, options, seed=seed + k)
        for k, pose in enumerate(POSES)
    ]
    scene = FrozenScene(objects, camera, CAMERA_POSE, options, seed=seed)
    recording = record(native, objects, camera, CAMERA_POSE, options)
    return scene, recording.gradients(**scene.d_picture)


@pytest.fixture(scope="module")
def differences():
    """Differences by lens, degree and antialiasing: the same for every set of instructions."""
    return {}


@pytest.mark.parametrize(
    ("degree", "antialias"), [(0, False), (1, True), (2, False), (3, True), (3, False)]
)
def test_gradients_of_values_agree_with_differences(
    native, drawn_cloud, small_lens, differences, degree, antialias
):
    options = RenderOptions(background=(0.2, 0.5, 0.1), sh_degree=degree, antialias=antialias)
    scene, gradients = scene_and_gradients(
        native, drawn_cloud, small_lens, options, seed=10 * degree + antialias
    )
    wanted = differences.setdefault((small_lens, degree, antialias), {})
    if not wanted:
        wanted |= {
            (name, index, splat): scene.by_values(name, index, splat)
            for name in VALUES
            for index in range(2)
            for splat in range(0, len(scene.frozen.clouds[index]), 7)
        }
    for name in VALUES:
        pairs = [
            (value, getattr(gradients.objects[index], name)[splat].ravel())
            for (of, index, splat), value in wanted.items()
            if of == name
        ]
        assert_values_agree(pairs, TOLERANCE, name)


@pytest.mark.parametrize(("degree", "antialias"), [(0, False), (3, True)])
def test_gradients_of_poses_agree_with_differences(
    native, drawn_cloud, small_lens, degree, antialias
):
    options = RenderOptions(sh_degree=degree, antialias=antialias)
    scene, gradients = scene_and_gradients(native, drawn_cloud, small_lens, options, seed=degree)
    for index, found in enumerate(gradients.objects):
        wanted = scene.by_object_steps(index)
        assert_steps_agree(wanted, found.world_from_object, POSE_TOLERANCE)
    assert_steps_agree(scene.by_camera_steps(), gradients.world_from_camera, POSE_TOLERANCE)


def test_the_picture_is_the_renderers(native, drawn_cloud, small_lens):
    options = RenderOptions(background=(0.3, 0.1, 0.9))
    objects = [
        drawn_cloud(pose, small_lens, CAMERA_POSE, options, seed=3, count=200) for pose in POSES
    ]
    recorded = record(native, objects, small_lens, CAMERA_POSE, options).rendering
    drawn = native.render(objects, small_lens, CAMERA_POSE, options)
    for name in ("rgb", "alpha", "depth", "ids"):
        np.testing.assert_array_equal(getattr(recorded, name), getattr(drawn, name))


def test_the_number_of_threads_changes_nothing(native, wild_cloud, camera):
    objects = [PosedSplats(wild_cloud(2000, degree=1, seed=k), Pose.from_yaw(k)) for k in range(2)]
    pose = Pose(np.eye(3), [0.0, 0.0, -1.0])
    rng = np.random.default_rng(0)
    shape = (camera.height_px, camera.width_px)
    d_rgb = rng.normal(size=(*shape, 3)).astype(np.float32)
    d_alpha, d_depth = rng.normal(size=(2, *shape)).astype(np.float32)

    def gradients(threads):
        recording = record(native, objects, camera, pose, RenderOptions(threads=threads))
        return recording.gradients(d_rgb, d_alpha, d_depth)

    one = gradients(1)
    assert np.abs(one.objects[0].means).max() > 0
    for threads in (2, 3, 8):
        many = gradients(threads)
        np.testing.assert_array_equal(many.world_from_camera, one.world_from_camera)
        for a, b in zip(many.objects, one.objects, strict=True):
            for name in (*VALUES, "world_from_object"):
                np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_both_kernels_agree(wild_cloud, small_lens):
    objects = [PosedSplats(wild_cloud(400, degree=2, seed=1), Pose.identity())]
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    shape = (small_lens.height_px, small_lens.width_px)
    d_rgb = np.random.default_rng(1).normal(size=(*shape, 3)).astype(np.float32)
    one, other = (
        record(NativeRenderer(portable=portable), objects, small_lens, pose).gradients(d_rgb)
        for portable in (False, True)
    )
    for name in VALUES:
        a, b = (getattr(g.objects[0], name) for g in (one, other))
        assert np.abs(a - b).max() <= 2e-4 * np.abs(a).max(), name


@pytest.mark.parametrize("opacity", [0.999, 1.5])
def test_what_is_at_its_limit_has_no_gradient(native, ball, at_origin, opacity):
    camera = Pinhole(33, 33, 60.0, 60.0, 16.5, 16.5)
    dark = ball((0, 0, 2.0), sigma_m=0.3, opacity=opacity, colour=(-0.5, 0.5, 0.5))
    recording = record(native, at_origin(dark), camera, Pose.identity())
    d_rgb = np.zeros((33, 33, 3), dtype=np.float32)
    d_rgb[16, 17] = 1.0
    (found,) = recording.gradients(d_rgb).objects
    assert recording.rendering.alpha[16, 17] == pytest.approx(0.99)
    assert found.opacities[0] == 0
    assert not found.means.any()
    assert not found.scales.any()
    assert found.sh[0, 0, 0] == 0
    assert found.sh[0, 0, 1] == pytest.approx(0.99 * 0.28209479, rel=1e-5)


def test_nothing_outside_the_picture_or_the_lens_has_a_gradient(native, ball, at_origin):
    camera = Fisheye(60, 60, 14.0, 30.0, 30.0, np.radians(80))
    beside = ball((5.0, 0.0, -0.1), sigma_m=0.05)
    behind = ball((0.0, 0.0, -2.0), sigma_m=0.05)
    recording = record(native, at_origin(beside, behind), camera, Pose.identity())
    ones = np.ones((60, 60), dtype=np.float32)
    gradients = recording.gradients(np.ones((60, 60, 3), dtype=np.float32), ones, ones)
    for found in gradients.objects:
        for name in (*VALUES, "world_from_object"):
            assert not getattr(found, name).any()


def test_damaged_splats_have_no_gradient_and_harm_no_other(native, wild_cloud, small_lens):
    cloud = wild_cloud(40, degree=1, seed=4, spread_m=0.4)
    arrays = {name: getattr(cloud, name).copy() for name in VALUES}
    arrays["means"][0] = np.nan
    arrays["scales"][1] = 0.0
    arrays["rotations"][2] = 0.0
    arrays["opacities"][3] = np.inf
    arrays["sh"][4] = -np.inf
    arrays["sh"][5] = 2e15
    arrays["scales"][6] = 1e-30
    arrays["scales"][7] = 9e3
    arrays["means"][8] = 1e5
    arrays["rotations"][9] *= 1e-20
    pose = Pose(np.eye(3), [0.0, 0.0, -1.5])
    shape = (small_lens.height_px, small_lens.width_px)
    d_rgb = np.random.default_rng(1).normal(size=(*shape, 3)).astype(np.float32)
    options = RenderOptions(antialias=True)
    damaged = [PosedSplats(SplatCloud(**arrays), Pose.identity())]
    (found,) = record(native, damaged, small_lens, pose, options).gradients(d_rgb).objects
    for name in VALUES:
        assert not getattr(found, name)[:6].any()
        assert np.isfinite(getattr(found, name)[10:]).all()
    whole = {name: array[6:] for name, array in arrays.items()}
    sound = [PosedSplats(SplatCloud(**whole), Pose.identity())]
    (wanted,) = record(native, sound, small_lens, pose, options).gradients(d_rgb).objects
    for name in VALUES:
        np.testing.assert_array_equal(getattr(found, name)[6:], getattr(wanted, name))


def test_empty_pictures_have_empty_gradients(native, wild_cloud):
    camera = Pinhole.from_fov(20, 10, 1.0)
    empty = wild_cloud(0, degree=1)
    recording = record(native, [PosedSplats(empty, Pose.identity())], camera, Pose.identity())
    (found,) = recording.gradients(np.ones((10, 20, 3), dtype=np.float32)).objects
    assert found.means.shape == (0, 3)
    assert found.sh.shape == (0, 4, 3)
    assert record(native, [], camera, Pose.identity()).gradients().objects == ()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("d_rgb", np.zeros((10, 20), np.float32), r"d_rgb: got float32 \(10, 20\), wanted float32"),
        (
            "d_alpha",
            np.zeros((10, 20)),
            r"d_alpha: got float64 \(10, 20\), wanted float32 \(10, 20\)",
        ),
        ("d_depth", [[0.0]], r"d_depth: got list, wanted float32 \(10, 20\)"),
        ("d_alpha", np.full((10, 20), np.nan, np.float32), r"d_alpha: 200 of 200 values are not"),
    ],
)
def test_wrong_picture_gradients_are_refused(native, name, value, message):
    recording = record(native, [], Pinhole.from_fov(20, 10, 1.0), Pose.identity())
    with pytest.raises(ValueError, match=message):
        recording.gradients(**{name: value})
