"""A followed pose, and the one that replaces it."""

import math

import numpy as np

from scenes.cameras import Pinhole
from scenes.pose import Pose, rotation_from_vector
from tracking.headset.corner_fit import Belief, SeenPoints, code_corners
from tracking.headset.followed import CONVINCED_PICTURES, Followed, Wander, agrees, follow

CAMERA = Pinhole.from_fov(760, 428, math.radians(65))
TRUE = Pose(rotation_from_vector(np.array([math.pi - 0.3, 0.2, 0.1])), np.array([0.1, -0.1, 2.0]))
WANDER = Wander(1e-4, 1e-4)
MOVED = TRUE @ Pose(np.eye(3), np.array([0.3, 0.0, 0.0]))


def wide(pose):
    return Belief(pose, np.diag(np.repeat((0.3, 1.0), 3) ** 2), np.zeros(3), 0)


def seen_at(pose):
    pixels, _ = CAMERA.project(pose @ code_corners(0.24))
    return SeenPoints(CAMERA, Pose.identity(), code_corners(0.24), pixels, np.full(4, 0.05))


def after(known, pose, t_s):
    return follow(known, [seen_at(pose)], t_ns=round(t_s * 1e9), first=wide(pose), wander=WANDER)


def test_it_begins_and_stays_with_what_agrees():
    known, agreed = after(Followed(), TRUE, 0.0)
    assert agreed == (True,)
    assert agrees(known.belief, seen_at(TRUE))
    known, agreed = after(known, TRUE, 0.1)
    assert agreed == (True,)
    assert known.pictures == 2


def test_without_points_nothing_happens():
    known = Followed()
    assert follow(known, [], t_ns=0, first=None, wander=WANDER) == (known, ())


def test_one_contradiction_changes_nothing_and_many_do():
    known, _ = after(Followed(), TRUE, 0.0)
    known, agreed = after(known, MOVED, 0.1)
    assert agreed == (False,)
    assert known.restarts == 0
    for k in range(CONVINCED_PICTURES + 1):
        known, agreed = after(known, MOVED, 0.2 + 0.1 * k)
    assert known.restarts == 1
    assert agrees(known.belief, seen_at(MOVED))


def test_contradictions_that_disagree_with_each_other_never_convince():
    known, _ = after(Followed(), TRUE, 0.0)
    for k in range(20):
        elsewhere = TRUE @ Pose(np.eye(3), np.array([0.1 + 0.05 * k, 0.0, 0.0]))
        known, _ = after(known, elsewhere, 0.1 * (k + 1))
    assert known.restarts == 0
