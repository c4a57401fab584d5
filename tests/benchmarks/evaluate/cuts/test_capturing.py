"""Photos at wrong places end a capture's preparation, before minutes of training."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.evaluate.cuts.capturing import require_right_poses
from scenes.pose import Pose


def turned(view, degrees):
    turn = Pose.from_yaw(math.radians(degrees))
    return replace(view, world_from_camera=turn @ view.world_from_camera)


def test_a_world_of_its_own_is_as_right_as_the_true_one(cubes):
    truth = {view.name: view.world_from_camera for view in cubes.photos}
    own_from_true = Pose.from_yaw(1.0, (3.0, 2.0, 1.0))
    moved = [
        replace(view, world_from_camera=own_from_true @ view.world_from_camera)
        for view in cubes.photos
    ]
    require_right_poses(moved, truth)
    slightly = [
        turned(view, angle) for view, angle in zip(moved, np.linspace(0, 1, 12), strict=True)
    ]
    require_right_poses(slightly, truth)


def test_photos_that_were_turned_are_counted(cubes):
    truth = {view.name: view.world_from_camera for view in cubes.photos}
    views = [turned(view, 180 if k in (3, 4) else 0) for k, view in enumerate(cubes.photos)]
    with pytest.raises(ValueError, match=r"turned 2 of 12 photos .* up to 180°"):
        require_right_poses(views, truth)
