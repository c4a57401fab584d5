"""The code on the 360° camera."""

from dataclasses import replace

import numpy as np

from scenes.pose import Pose
from studio.live.hololens.rig_code import RigCode, is_apart, rig_code_after
from tracking.headset.corner_fit import Belief
from tracking.headset.followed import Followed
from tracking.headset.origin import Origin

RIG = Pose.from_yaw(0.3, (1.0, 0.0, 1.2))
CODE = Pose.from_yaw(0.1, (0.0, 0.1, -0.2))


def seen(world_from_code, *, sigma=0.001, restarts=0):
    belief = Belief(world_from_code, np.eye(6) * sigma**2, np.zeros(3), 0)
    return Origin(carried=Followed(belief, restarts=restarts))


def test_its_place_on_the_camera_is_learnt_once_both_are_known():
    known, moved = rig_code_after(RigCode(), seen(RIG @ CODE), world_from_rig=None)
    assert known.rig_from_code is None
    assert moved is None
    known, moved = rig_code_after(known, seen(RIG @ CODE, sigma=0.1), world_from_rig=RIG)
    assert known.rig_from_code is None
    known, moved = rig_code_after(known, seen(RIG @ CODE), world_from_rig=RIG)
    assert np.allclose(known.rig_from_code.matrix(), CODE.matrix())
    assert moved is None


def test_a_camera_that_was_moved_is_where_its_code_is():
    known, _ = rig_code_after(RigCode(), seen(RIG @ CODE), world_from_rig=RIG)
    elsewhere = Pose.from_yaw(1.0, (0.2, 0.6, 1.1))
    known, moved = rig_code_after(
        known, seen(elsewhere @ CODE, sigma=0.2, restarts=1), world_from_rig=RIG
    )
    assert moved is None  # seen too little
    known, moved = rig_code_after(known, seen(elsewhere @ CODE, restarts=1), world_from_rig=RIG)
    assert np.allclose(moved.matrix(), elsewhere.matrix())
    assert rig_code_after(known, seen(elsewhere @ CODE, restarts=1), world_from_rig=RIG)[1] is None
    assert is_apart(moved, RIG)
    assert not is_apart(RIG, RIG)
    assert is_apart(RIG, None)


def test_without_a_code_nothing_is_known():
    known = replace(RigCode(), moves=0)
    assert rig_code_after(known, Origin(), world_from_rig=RIG) == (known, None)
