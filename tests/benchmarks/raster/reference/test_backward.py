"""The chain rule in numpy: differences hold it on small scenes, it the kernels on large ones."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks.raster.reference.backward import backward
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gradients import Gradients, record
from scenes.render.renderer import PosedSplats, RenderOptions
from tests.scenes.render.frozen_scene import (
    VALUES,
    FrozenScene,
    assert_steps_agree,
    assert_values_agree,
    waves,
)
from tests.scenes.render.test_gradients import POSE_TOLERANCE, TOLERANCE

TWIN_TOLERANCE = 1e-6
"""Of the same norms as `TOLERANCE`, between the chain rule and differences."""


@dataclass(frozen=True)
class Place:
    """Where two small objects are before a lens."""

    camera: Pinhole | Fisheye
    world_from_camera: Pose
    world_from_objects: tuple[Pose, Pose]


TURNED = Pose.from_quaternion(np.array([0.5, 0.5, -0.5, 0.5]), (0.3, 0.1, 1.0))
PLACES = {
    "pinhole, the second object beyond its border": Place(
        Pinhole(28, 22, 30.0, 26.0, 13.0, 12.0),
        Pose(np.eye(3), [0.1, 0.2, -1.0]),
        (Pose.from_yaw(0.3, (0.1, 0.2, 0.6)), replace(TURNED, translation=[1.3, 0.3, 0.8])),
    ),
    "fisheye, the second object more than 90° off its axis": Place(
        Fisheye.from_fov(28, np.radians(260)),
        Pose(np.eye(3), [0.1, 0.2, -1.0]),
        (Pose.from_yaw(0.3, (0.1, 0.2, 0.4)), replace(TURNED, translation=[1.3, 0.4, -1.5])),
    ),
    "fisheye with coefficients": Place(
        Fisheye(28, 28, 7.0, 13.0, 14.5, np.radians(120), (0.05, -0.01, 0.002, 2e-4)),
        Pose(np.eye(3), [0.1, 0.2, -1.0]),
        (Pose.from_yaw(0.3, (0.1, 0.2, 0.4)), replace(TURNED, translation=[1.3, 0.4, -1.5])),
    ),
}


def at_limits(cloud):
    """Some opacities are above 1, some colours below 0."""
    return replace(cloud, opacities=1.5 * cloud.opacities, sh=2.0 * cloud.sh)


def small_scene(drawn_cloud, place, options, seed):
    objects = []
    for index, pose in enumerate(place.world_from_objects):
        posed = drawn_cloud(
            pose, place.camera, place.world_from_camera, options, seed=seed + index, count=9
        )
        # Wide enough that pixels near a centre are at the limit of alpha.
        wide = replace(at_limits(posed.cloud), scales=3.0 * posed.cloud.scales)
        objects.append(PosedSplats(wide, pose))
    return FrozenScene(objects, place.camera, place.world_from_camera, options, seed=seed)


def chain_rule(scene):
    return backward(
        scene.objects, scene.camera, scene.world_from_camera, scene.options, **scene.d_picture
    )


@pytest.fixture(params=PLACES)
def place(request):
    return PLACES[request.param]


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_chain_rule_agrees_with_differences(drawn_cloud, place, degree):
    options = RenderOptions((0.2, 0.5, 0.1), sh_degree=degree, antialias=degree % 2 == 1)
    scene = small_scene(drawn_cloud, place, options, seed=degree)
    found = chain_rule(scene)
    used = {"means": 3, "scales": 3, "rotations": 4, "opacities": 1, "sh": 3 * (degree + 1) ** 2}
    for name in VALUES:
        pairs = []
        for index, gradients in enumerate(found.objects):
            got = getattr(gradients, name).reshape(len(gradients.means), -1)
            assert not got[:, used[name] :].any()
            pairs += [
                (scene.by_values(name, index, i, used[name]), got[i, : used[name]])
                for i in range(0, len(got), 6)
            ]
        assert_values_agree(pairs, TWIN_TOLERANCE, name)
    for index, gradients in enumerate(found.objects):
        wanted = scene.by_object_steps(index)
        assert_steps_agree(wanted, gradients.world_from_object, TWIN_TOLERANCE)
    assert_steps_agree(scene.by_camera_steps(), found.world_from_camera, TWIN_TOLERANCE)


class PricedScene(FrozenScene):
    """A loss of where the light comes from: field · (z - 1.3)² per unit of weight."""

    def loss(self, **changed):
        weights, depths = self.frozen.light(**changed)
        prices = (depths - 1.3) ** 2
        return float(np.einsum("khw,k,hw->", weights, prices, self.d_picture["d_alpha"]))

    def price(self, depth):
        field = self.d_picture["d_alpha"].astype(np.float64)
        return field * (depth - 1.3) ** 2, field * 2 * (depth - 1.3)


def test_a_price_of_light_has_the_gradients_of_differences(drawn_cloud, place):
    plain = small_scene(drawn_cloud, place, RenderOptions(), seed=5)
    scene = PricedScene(plain.objects, place.camera, place.world_from_camera, plain.options, seed=5)
    found = backward(
        scene.objects, scene.camera, scene.world_from_camera, scene.options, price=scene.price
    )
    for name in ("means", "scales", "rotations", "opacities"):
        pairs = [
            (scene.by_values(name, index, i), getattr(gradients, name)[i].ravel())
            for index, gradients in enumerate(found.objects)
            for i in range(0, len(gradients.means), 6)
        ]
        assert_values_agree(pairs, TWIN_TOLERANCE, name)
    assert not any(gradients.sh.any() for gradients in found.objects)
    assert_steps_agree(scene.by_camera_steps(), found.world_from_camera, TWIN_TOLERANCE)


def test_small_scenes_reach_where_the_chain_bends(drawn_cloud, place):
    scene = small_scene(drawn_cloud, place, RenderOptions(), seed=0)
    second = scene.objects[1]
    camera_from_object = place.world_from_camera.inverse() @ second.world_from_object
    points = camera_from_object @ second.cloud.means.astype(np.float64)
    seen = np.abs(chain_rule(scene).objects[1].means).max(axis=1) > 0.1
    if isinstance(place.camera, Pinhole):
        pixels, _ = place.camera.project(points)
        assert (seen & (pixels[:, 0] > 1.15 * place.camera.width_px)).any()
    else:
        assert (seen & (points[:, 2] < 0)).any()
    assert (second.cloud.opacities > 1).any()
    assert (second.cloud.opacities < 1).any()


@dataclass(frozen=True)
class LargeScene:
    """More splats than differences can afford, and what the chain rule says of them."""

    objects: list[PosedSplats]
    camera: Pinhole | Fisheye
    world_from_camera: Pose
    options: RenderOptions
    d_picture: dict[str, np.ndarray]
    wanted: Gradients


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "antialias"])
def large(request, camera, wild_cloud):
    objects = []
    for index in range(2):
        cloud = at_limits(wild_cloud(150, degree=3, seed=index))
        cloud = replace(cloud, scales=np.minimum(cloud.scales, 0.3))
        objects.append(PosedSplats(cloud, Pose.from_yaw(index)))
    world_from_camera = Pose(np.eye(3), [0.0, 0.0, -1.0])
    options = RenderOptions((0.2, 0.5, 0.1), antialias=request.param)
    d_picture = waves(camera, seed=0)
    wanted = backward(objects, camera, world_from_camera, options, **d_picture)
    return LargeScene(objects, camera, world_from_camera, options, d_picture, wanted)


def test_kernels_agree_with_the_chain_rule(native, large):
    recording = record(native, large.objects, large.camera, large.world_from_camera, large.options)
    got = recording.gradients(**large.d_picture)
    for name in VALUES:
        pairs = [
            (a.ravel().astype(np.float64), b.ravel())
            for ours, theirs in zip(large.wanted.objects, got.objects, strict=True)
            for a, b in zip(getattr(ours, name), getattr(theirs, name), strict=True)
        ]
        assert_values_agree(pairs, TOLERANCE, name)
    for ours, theirs in zip(large.wanted.objects, got.objects, strict=True):
        assert_steps_agree(ours.world_from_object, theirs.world_from_object, POSE_TOLERANCE)
    assert_steps_agree(large.wanted.world_from_camera, got.world_from_camera, POSE_TOLERANCE)


@pytest.mark.parametrize("opacity", [0.999, 1.5])
def test_a_splat_at_its_limits_has_no_gradient(ball, at_origin, opacity):
    camera = Pinhole(33, 33, 60.0, 60.0, 16.5, 16.5)
    dark = ball((0, 0, 2.0), sigma_m=0.3, opacity=opacity, colour=(-0.5, 0.5, 0.5))
    d_rgb = np.zeros((33, 33, 3), dtype=np.float32)
    d_rgb[16, 17] = 1.0
    objects = at_origin(dark)
    (found,) = backward(objects, camera, Pose.identity(), RenderOptions(), d_rgb=d_rgb).objects
    assert found.opacities[0] == 0
    assert not found.means.any()
    assert not found.scales.any()
    assert found.sh[0, 0, 0] == 0
    assert found.sh[0, 0, 1] == pytest.approx(0.99 * 0.28209479, rel=1e-6)


def test_a_splat_behind_gains_what_the_one_in_front_lets_through(ball, at_origin):
    camera = Pinhole(1, 1, 1.0, 1.0, 0.5, 0.5)
    front = ball((0, 0, 1.0), opacity=0.5, colour=(1.0, 0.0, 0.0))
    behind = ball((0, 0, 2.0), opacity=0.25, colour=(0.0, 1.0, 0.0))
    objects = at_origin(front, behind)
    d_rgb = np.ones((1, 1, 3), dtype=np.float32)
    found = backward(objects, camera, Pose.identity(), RenderOptions(), d_rgb=d_rgb).objects
    # rgb sums to o₁ + (1 - o₁) o₂, and depth is not asked for.
    assert found[0].opacities[0] == pytest.approx(1 - 0.25, rel=1e-6)
    assert found[1].opacities[0] == pytest.approx(1 - 0.5, rel=1e-6)


@pytest.mark.parametrize("tangent", [0.0, 1e-9, 0.9e-3, 1.1e-3])
@pytest.mark.parametrize("k1", [0.0, 0.1])
def test_the_axis_of_a_fisheye_is_not_special(ball, tangent, k1):
    camera = Fisheye(21, 21, 12.0, 10.5, 10.5, np.radians(100), (k1, 0.0, 0.0, 0.0))
    needle = replace(
        ball((1.6 * tangent, -1.2 * tangent, 2.0), opacity=0.7),
        scales=np.array([[0.3, 0.05, 0.4]], dtype=np.float32),
        rotations=np.array([[0.8, 0.2, -0.4, 0.1]], dtype=np.float32),
    )
    objects = [PosedSplats(needle, Pose.identity())]
    scene = FrozenScene(objects, camera, Pose.identity(), RenderOptions(), seed=1)
    (found,) = chain_rule(scene).objects
    wanted = scene.by_values("means", 0, 0)
    assert_values_agree([(wanted, found.means[0])], TWIN_TOLERANCE, "means")
    assert_steps_agree(scene.by_object_steps(0), found.world_from_object, TWIN_TOLERANCE)


def test_empty_and_unseen_clouds_have_empty_and_zero_gradients(wild_cloud):
    camera = Pinhole.from_fov(20, 10, 1.0)
    empty = PosedSplats(wild_cloud(0, degree=1), Pose.identity())
    unseen = PosedSplats(wild_cloud(3), Pose(np.eye(3), [0.0, 0.0, -50.0]))
    d_rgb = np.ones((10, 20, 3), dtype=np.float32)
    found = backward([empty, unseen], camera, Pose.identity(), RenderOptions(), d_rgb=d_rgb)
    assert found.objects[0].sh.shape == (0, 4, 3)
    assert found.objects[1].means.shape == (3, 3)
    for name in (*VALUES, "world_from_object"):
        assert not getattr(found.objects[1], name).any()
    assert not found.world_from_camera.any()


def test_exact_wide_splats_are_refused():
    options = RenderOptions(exact_above_rad=0.1)
    with pytest.raises(ValueError, match=r"exact_above_rad: got 0\.1, wanted inf"):
        backward([], Pinhole.from_fov(20, 10, 1.0), Pose.identity(), options)


def test_wrong_picture_gradients_are_refused():
    camera = Pinhole.from_fov(20, 10, 1.0)
    with pytest.raises(ValueError, match=r"d_rgb: got float64 \(10, 20, 3\), wanted float32"):
        backward([], camera, Pose.identity(), RenderOptions(), d_rgb=np.zeros((10, 20, 3)))
