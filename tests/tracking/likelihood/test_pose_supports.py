"""Many poses are weighed in one native call as each is alone, and as the numpy twin says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.pose import Pose
from tracking.evidence.observation import observe
from tracking.likelihood import pose_likelihood
from tracking.likelihood.drawn_object import levels_for, radii_at, radius_px
from tracking.likelihood.pixel_model import EXACTLY, NOT_IN_VIEW, ROUGHLY
from tracking.likelihood.pose_likelihood import MIN_SHARED, pose_support, pose_supports
from tracking.model.object_model import RENDER_OPTIONS


def poses_around(world_from_object):
    """Poses near, beside, above, turned, half out of the window, behind the camera and far away."""
    place, yaw = world_from_object.translation, world_from_object.yaw()
    steps = [(0.0, 0.0, 0.0), (0.02, 0.01, 0.0), (-0.1, 0.0, 0.05), (0.0, 0.15, 0.0)]
    turns = (0.0, 0.3, math.pi)
    near = [Pose.from_yaw(yaw + turn, place + np.array(step)) for step in steps for turn in turns]
    away = [(-0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (30.0, 30.0, 0.0), (0.0, -30.0, 0.0)]
    return near + [Pose.from_yaw(yaw, place + np.array(step)) for step in away]


def observed(table, scene, name, *, shrink=1):
    """An object's window, as large as any yaw needs."""
    return observe(scene, table.evidence(scene, name, table.poses[name])).shrunk(shrink)


def assert_same(observation, model, poses, renderer, **compared):
    found = pose_supports(observation, model, poses=poses, renderer=renderer, **compared)
    for pose, said in zip(poses, found, strict=True):
        alone = pose_support(observation, model, pose, renderer, **compared)
        assert said == alone
    return found


@pytest.mark.parametrize("name", ["book-1", "mug-1", "box-1"])
@pytest.mark.parametrize("tolerance", [EXACTLY, ROUGHLY])
@pytest.mark.parametrize("is_coarse", [True, False])
@pytest.mark.parametrize("shrink", [1, 2])
def test_all_poses_are_weighed_as_each_alone(table, as_scanned, name, tolerance, is_coarse, shrink):
    observation = observed(table, as_scanned, name, shrink=shrink)
    poses = poses_around(table.poses[name])
    found = assert_same(
        observation,
        table.models[name],
        poses,
        table.renderer,
        tolerance=tolerance,
        is_coarse=is_coarse,
    )
    assert found[-2] == NOT_IN_VIEW
    assert found[0].nats == max(support.nats for support in found)


def test_a_shade_is_weighed_alike(table, no_mug):
    observation = replace(observed(table, no_mug, "mug-1"), in_any_light=True)
    poses = poses_around(table.poses["mug-1"])
    assert_same(observation, table.models["mug-1"], poses, table.renderer, is_coarse=True)


def test_a_lens_with_coefficients_keeps_its_tables(table, as_scanned):
    observation = observed(table, as_scanned, "box-1")
    equidistant = observation.camera
    lens = Fisheye(
        equidistant.width_px,
        equidistant.height_px,
        equidistant.f_px,
        equidistant.cx,
        equidistant.cy,
        equidistant.max_angle,
        (0.02, -0.01, 0.001, 0.0),
    )
    bent, poses = replace(observation, camera=lens), poses_around(table.poses["box-1"])
    found = assert_same(bent, table.models["box-1"], poses, table.renderer)
    assert found[0] != pose_support(observation, table.models["box-1"], poses[0], table.renderer)


def test_two_threads_say_the_same_to_the_bit(table, as_scanned, monkeypatch):
    observation, model = observed(table, as_scanned, "book-1"), table.models["book-1"]
    poses = poses_around(table.poses["book-1"])
    one = pose_supports(observation, model, poses=poses, renderer=table.renderer)
    two_threads = replace(RENDER_OPTIONS, threads=2)
    monkeypatch.setattr(pose_likelihood, "RENDER_OPTIONS", two_threads)
    assert pose_supports(observation, model, poses=poses, renderer=table.renderer) == one


def test_no_pose_has_no_support(table, as_scanned):
    observation = observed(table, as_scanned, "mug-1")
    assert (
        pose_supports(observation, table.models["mug-1"], poses=[], renderer=table.renderer) == []
    )


@pytest.mark.parametrize("is_coarse", [True, False])
def test_each_pose_has_its_own_level(table, as_scanned, is_coarse):
    observation, model = observed(table, as_scanned, "box-1"), table.models["box-1"]
    towards = as_scanned.world_from_rig.translation - table.poses["box-1"].translation
    poses = [
        Pose.from_yaw(0.0, table.poses["box-1"].translation + share * towards)
        for share in (-4.0, -1.0, 0.0, 0.5, 0.9)
    ]
    radii = radii_at(observation, model, poses=poses)
    alone = [radius_px(observation, model, pose) for pose in poses]
    assert radii == pytest.approx(alone, rel=1e-12)
    levels, which = levels_for(model, radii, is_coarse=is_coarse)
    share = 0.5 if is_coarse else 1.0
    assert [levels[index] for index in which] == [model.level_for(share * px) for px in alone]
    assert len(levels) > 1


def test_many_poses_are_shared_by_the_processors_to_the_bit(table, as_scanned):
    observation, model = observed(table, as_scanned, "box-1"), table.models["box-1"]
    yaws = np.linspace(0.0, 3.0, MIN_SHARED)
    poses = [Pose.from_yaw(float(yaw), table.poses["box-1"].translation) for yaw in yaws]

    def of(poses):
        return pose_supports(
            observation, model, poses=poses, renderer=table.renderer, is_coarse=True
        )

    half = MIN_SHARED // 2
    assert of(poses) == [*of(poses[:half]), *of(poses[half:])]
