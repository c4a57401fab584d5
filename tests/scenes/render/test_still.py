"""A still view against full pictures, bit for bit, over sequences of changes."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.render.renderer import TILE_PX, PosedSplats, RenderOptions
from scenes.render.still import StillView
from scenes.splats import SplatCloud

BACK = Pose(np.eye(3), [0.0, 0.0, -2.0])
OPTIONS = RenderOptions(background=(0.1, 0.5, 0.9), sh_degree=1, threads=2)
PARTS = ("rgb", "alpha", "depth", "ids")


def assert_same(rendering, wanted):
    for name in PARTS:
        np.testing.assert_array_equal(getattr(rendering, name), getattr(wanted, name), name)


def random_pose(rng):
    quaternion = rng.normal(size=4)
    return Pose.from_quaternion(quaternion / np.linalg.norm(quaternion), rng.uniform(-0.8, 0.8, 3))


def random_change(objects, clouds, rng):
    """Move one object or several, add, drop or swap some, or do nothing."""
    objects = list(objects)
    kind = rng.integers(6)
    if kind <= 1 and objects:
        for index in rng.choice(len(objects), size=1 + kind * (len(objects) > 1), replace=False):
            objects[index] = PosedSplats(objects[index].cloud, random_pose(rng))
    elif kind == 2:
        cloud = clouds[rng.integers(len(clouds))]
        objects.insert(rng.integers(len(objects) + 1), PosedSplats(cloud, random_pose(rng)))
    elif kind == 3 and objects:
        del objects[rng.integers(len(objects))]
    elif kind == 4:
        objects.reverse()
    return objects


@pytest.mark.parametrize("seed", range(3))
def test_every_update_equals_a_full_picture(native, wild_cloud, camera, seed):
    rng = np.random.default_rng(seed)
    clouds = [
        wild_cloud(400, degree=1, seed=1),
        *(wild_cloud(60, seed=k, spread_m=0.1) for k in (2, 3)),
        wild_cloud(0),
    ]
    objects = [PosedSplats(cloud, Pose.identity()) for cloud in clouds]
    view = StillView(native, camera, world_from_camera=BACK, options=OPTIONS)
    for _ in range(12):
        refresh = view.update(objects)
        assert_same(refresh.rendering, native.render(objects, camera, BACK, OPTIONS))
        objects = random_change(objects, clouds, rng)


def test_ties_of_depth_between_objects_are_kept(native, wild_cloud, camera):
    """Sheets of equal depth, so that only the order of objects decides."""

    def sheet(seed):
        cloud = wild_cloud(60, seed=seed, spread_m=0.4)
        means = cloud.means.copy()
        means[:, 2] = 0.5
        return SplatCloud(means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh)

    objects = [PosedSplats(sheet(seed), Pose.identity()) for seed in (1, 2, 3)]
    # A twin of the first object: equal in every splat.
    objects.append(objects[0])
    view = StillView(native, camera, world_from_camera=BACK, options=OPTIONS)
    assert_same(view.update(objects).rendering, native.render(objects, camera, BACK, OPTIONS))
    objects[1] = PosedSplats(objects[1].cloud, Pose(np.eye(3), [0.1, 0.0, 0.0]))
    assert_same(view.update(objects).rendering, native.render(objects, camera, BACK, OPTIONS))


def test_only_tiles_that_the_object_touches_are_drawn(native, wild_cloud, ball, camera):
    room = PosedSplats(wild_cloud(300, seed=4), Pose.identity())
    speck = ball((0.0, 0.0, 0.0), sigma_m=0.01)
    view = StillView(native, camera, world_from_camera=BACK, options=OPTIONS)
    first = view.update([room, PosedSplats(speck, Pose.identity())])
    assert first.drawn.all()
    assert first.drawn.shape == (-(-camera.height_px // TILE_PX), -(-camera.width_px // TILE_PX))

    assert not view.update([room, PosedSplats(speck, Pose.identity())]).drawn.any()

    before = first.rendering.rgb.copy()
    moved = view.update([room, PosedSplats(speck, Pose(np.eye(3), [0.01, 0.0, -0.2]))])
    assert moved.drawn.any()
    assert not moved.drawn.all()
    changed = (moved.rendering.rgb != before).any(axis=2)
    of_pixel = moved.drawn.repeat(TILE_PX, axis=0).repeat(TILE_PX, axis=1)
    assert not changed[~of_pixel[: camera.height_px, : camera.width_px]].any()
    assert changed.any()


def test_the_number_of_threads_changes_nothing(native, wild_cloud, camera):
    objects = [PosedSplats(wild_cloud(500, seed=k), Pose.from_yaw(k)) for k in range(2)]
    moved = [objects[0], PosedSplats(objects[1].cloud, Pose.from_yaw(2.0))]
    pictures = []
    for threads in (1, 4):
        view = StillView(
            native, camera, world_from_camera=BACK, options=RenderOptions(threads=threads)
        )
        view.update(objects)
        pictures.append(view.update(moved).rendering)
    assert_same(*pictures)


def test_the_picture_is_read_only_and_the_views_own(native, ball, at_origin, camera):
    view = StillView(native, camera, world_from_camera=BACK, options=OPTIONS)
    first = view.update(at_origin(ball((0.0, 0.0, 0.0)))).rendering
    with pytest.raises(ValueError, match="read-only"):
        first.rgb[0, 0, 0] = 1.0
    second = view.update(()).rendering
    assert second is first
    assert not first.alpha.any()


def test_a_bad_request_is_refused_and_leaves_the_view_usable(native, ball, at_origin, camera):
    with pytest.raises(ValueError, match=r"options\.near_m"):
        StillView(native, camera, world_from_camera=BACK, options=RenderOptions(near_m=0.0))
    view = StillView(native, camera, world_from_camera=BACK, options=OPTIONS)
    objects = at_origin(ball((0.0, 0.0, 0.0)))
    cloud = objects[0].cloud
    bad = SplatCloud.__new__(SplatCloud)
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        object.__setattr__(bad, name, getattr(cloud, name))
    object.__setattr__(bad, "means", cloud.means.astype(np.float64))
    with pytest.raises(ValueError, match=r"objects\[0\]\.cloud\.means"):
        view.update(at_origin(bad))
    assert_same(view.update(objects).rendering, native.render(objects, camera, BACK, OPTIONS))
