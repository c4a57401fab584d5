"""What the wearer sees."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from devices.hololens.display_list import Label, Shape, Solid
from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from studio.live.hololens.showing.view import seen_by_wearer

RED = (1.0, 0.0, 0.0, 1.0)


def frame(pose):
    picture = np.zeros((428, 760, 3), np.uint8)
    camera = Pinhole.from_fov(760, 428, math.radians(64.7))
    return SimpleNamespace(image=picture, camera=camera, world_from_camera=pose)


AHEAD = look_at(np.zeros(3), np.array([0.0, 2.0, 0.0]))


@pytest.mark.parametrize("shape", Shape)
def test_every_shape_is_seen_where_it_is(shape):
    turn = Pose.from_yaw(0.4, (0.3, 2.0, 0.2)).rotation
    solid = Solid(shape, Pose(turn, np.array([0.3, 2.0, -0.3])), (0.2, 0.2, 0.2), RED)
    shown = seen_by_wearer(frame(AHEAD), [solid])
    y, x = np.nonzero(shown[..., 0] > 128)
    assert abs(x.mean() - (380 + 600 * 0.15)) < 8
    assert abs(y.mean() - (214 + 600 * 0.15)) < 8


def test_what_is_nearer_covers_what_is_farther():
    far = Solid(Shape.CUBE, Pose(np.eye(3), np.array([0.0, 3.0, 0.0])), (0.5, 0.5, 0.5), RED)
    near = Solid(Shape.CUBE, Pose(np.eye(3), np.array([0.0, 2.0, 0.0])), (0.2,) * 3, (0, 1, 0, 1.0))
    shown = seen_by_wearer(frame(AHEAD), [near, far])
    assert shown[214, 380].tolist() == [0, 255, 0]


def test_words_are_written_and_what_is_behind_is_not_seen():
    words = Label("chair", Pose(np.eye(3), np.array([0.0, 2.0, 0.0])))
    assert seen_by_wearer(frame(AHEAD), [words]).any()
    behind = Solid(Shape.CUBE, Pose(np.eye(3), np.array([0.0, -2.0, 0.0])), (0.5, 0.5, 0.5), RED)
    assert not seen_by_wearer(frame(AHEAD), [behind]).any()
    assert not seen_by_wearer(frame(None), [words]).any()


@pytest.mark.parametrize("x", [0.0, -1.4, 9.0])
def test_what_is_translucent_lets_the_picture_through(x):
    given = frame(AHEAD)
    given.image[:] = 100
    half = Solid(
        Shape.CUBE, Pose(np.eye(3), np.array([x, 2.0, 0.0])), (0.5,) * 3, (1.0, 0.0, 0.0, 0.5)
    )
    solid = Solid(Shape.CUBE, half.world_from_item, half.size_m, RED)
    shown, opaque = (seen_by_wearer(given, [item]) for item in (half, solid))
    changed = opaque != 100
    assert changed.any() == (x < 9.0), "the last one is beside the picture"
    blended = (opaque.astype(float) + 100.0) / 2.0
    assert np.abs(shown.astype(float) - blended).max() <= 2.0
    assert (shown[~changed] == 100).all()
