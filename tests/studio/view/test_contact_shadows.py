"""Objects darken what they stand on, wherever that is, and nothing else."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from studio.view.contact_shadows import CELLS, contact_shadow, tilt_of
from studio.view.twin import Twin

CAMERA = Pinhole.from_fov(240, 180, 1.0)
EYE = look_at(np.array([0.0, -2.6, 2.0]), np.array([0.0, 0.0, 0.0]))
SIDE_M = 0.3
LIFT = np.array([0.0, 0.0, 0.4])


def cloud(means, sigma, level):
    count = len(means)
    return SplatCloud(
        means=np.asarray(means, np.float32),
        scales=np.full((count, 3), sigma, np.float32),
        rotations=np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        opacities=np.full(count, 0.95, np.float32),
        sh=np.full((count, 1, 3), (level - 0.5) / 0.28209479, np.float32),
    )


def grid(*axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


@pytest.fixture(scope="module")
def twin():
    steps = np.linspace(-1.5, 1.5, 76)
    floor = cloud(np.column_stack([grid(steps, steps), np.zeros(76**2)]), [0.03, 0.03, 0.003], 0.8)
    side = np.linspace(-SIDE_M / 2, SIDE_M / 2, 13)
    crate = cloud(grid(side, side, side + SIDE_M / 2), 0.012, 0.6)
    item = SimpleNamespace(object_id="crate", splats=crate, world_from_object=Pose.identity())
    footprint = np.array([[-1.5, -1.5], [1.5, 1.5]])
    scene = SimpleNamespace(room=floor, objects=(item,), footprint_m=footprint)
    return Twin(scene, NativeRenderer())


def light_at(twin, place, pose):
    """How light the picture is around a place, 0..1, with the crate at a pose."""
    pixels, _ = CAMERA.project(EYE.inverse() @ np.atleast_2d(place))
    x, y = np.round(pixels[0]).astype(int)
    picture = twin.picture({"crate": pose}, CAMERA, EYE)
    return picture[y - 1 : y + 2, x - 1 : x + 2].mean() / 255.0


BESIDE = np.array([0.0, -SIDE_M / 2 - 0.02, 0.0])
AWAY = Pose.from_yaw(0.0, (0.8, 0.5, 0.0))


def test_what_an_object_stands_on_is_darker_beside_it(twin):
    bare = light_at(twin, BESIDE, AWAY)
    assert bare == pytest.approx(0.8, abs=0.02)
    assert light_at(twin, BESIDE, Pose.identity()) < 0.88 * bare


def test_the_shadow_goes_with_the_object_and_turns_with_it(twin):
    moved = AWAY.translation + BESIDE
    assert light_at(twin, moved, AWAY) < 0.88 * light_at(twin, moved, Pose.identity())
    corner = np.array([0.0, -SIDE_M / math.sqrt(2) - 0.01, 0.0])
    turned = Pose.from_yaw(math.radians(45), (0.0, 0.0, 0.0))
    assert light_at(twin, corner, turned) < light_at(twin, corner, Pose.identity()) - 0.02


def test_in_the_air_and_far_away_nothing_is_darker(twin):
    lifted = Pose.from_yaw(0.0, (0.0, 0.0, 0.4))
    for place in (BESIDE, np.array([-0.9, 0.0, 0.0])):
        assert light_at(twin, place, lifted) == pytest.approx(light_at(twin, place, AWAY), abs=0.01)


def test_the_object_itself_is_as_it_was(twin):
    front = np.array([0.0, -SIDE_M / 2, 0.1])
    in_the_air = light_at(twin, front + LIFT, Pose.from_yaw(0.0, (0.0, 0.0, 0.4)))
    assert light_at(twin, front, Pose.identity()) == pytest.approx(in_the_air, abs=0.05)


def test_a_map_follows_how_the_object_leans():
    steps = np.linspace(0.0, 1.0, 41)
    pole = cloud(np.column_stack([np.zeros((41, 2)), steps]), 0.02, 0.5)
    upright = contact_shadow(pole)
    fallen = Pose.from_yaw(0.7, (0, 0, 0)).rotation @ np.array(
        [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    )
    lying = contact_shadow(pole, tilt_of(fallen))
    assert (lying.dark > 0.2).sum() * lying.cell_m**2 > 5 * (upright.dark > 0.2).sum() * (
        upright.cell_m**2
    )
    for shadow in (upright, lying):
        assert shadow.dark.shape == (CELLS, CELLS)
        assert shadow.dark[[0, -1]].max() < 0.02
    assert contact_shadow(pole.select(np.zeros(0, np.intp))) is None
