"""Furniture as solids: boxes that move with objects, slabs of a mesh, arms that stay out."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from scenes.bodies.crowd import Crowd
from scenes.bodies.furniture import LEVEL_M, Furniture, level_slabs, solids_of
from scenes.bodies.goals import unknown
from scenes.bodies.skeleton import ELBOW, Bone, arm_rows
from scenes.bodies.solids import MAX_DEPTH_M, Solids, no_solids
from scenes.bodies.solve import solve_bodies
from scenes.bodies.torso import rotation_of
from scenes.bodies.vectors import cross, dot, length, unit
from scenes.mesh import BoxPart, CollisionMesh
from scenes.pose import Pose
from scenes.samples import unlit_room
from scenes.state import Avatar

TABLE = BoxPart(Pose(np.eye(3), np.array([0.0, 0.0, 0.72])), (0.8, 0.4, 0.02))


def test_parts_go_where_their_object_is_and_stand_where_it_was_scanned():
    parts = {"table-1": solids_of([TABLE])}
    scanned = Pose.from_yaw(0.0, (1.0, 0.0, 0.0))
    furniture = Furniture(no_solids(), parts, {"table-1": scanned})
    assert furniture.at({}).centres.tolist() == [[1.0, 0.0, 0.72]]
    moved = furniture.at({"table-1": Pose.from_yaw(np.pi / 2, (0.0, 2.0, 0.0))})
    assert moved.centres[0] == pytest.approx([0.0, 2.0, 0.72])
    # It has turned: long along y.
    assert moved.depths(np.array([[0.0, 2.7, 0.72], [0.7, 2.0, 0.72]])).tolist() == [0.02, 0.0]
    assert len(furniture.at({}).near(np.array([[5.0, 0.0, 1.6]]), 1.3).centres) == 0


def test_level_parts_of_a_scanned_mesh_become_slabs():
    def square(z, side):
        return np.array([[0, 0, z], [side, 0, z], [side, side, z], [0, side, z]], float)

    corners = [square(0.0, 4.0), square(0.73, 1.2), np.add(square(0.73, 0.05), (3, 3, 0))]
    wall = np.array([[0, 0, 0], [0, 4, 0], [0, 4, 2.5], [0, 0, 2.5]], float)
    vertices = np.concatenate([*corners, wall])
    faces = np.concatenate([[[k, k + 1, k + 2], [k, k + 2, k + 3]] for k in range(0, 16, 4)])
    slabs = level_slabs(CollisionMesh(vertices.astype(np.float32), faces))
    assert len(slabs.centres) == 1, "the table; no floor, no wall, no crumb"
    assert slabs.halves[0] == pytest.approx([0.6, 0.6, LEVEL_M / 2], abs=0.08)
    assert slabs.depths(np.array([[0.5, 0.5, 0.73]]))[0] > 0.005


def dense(skeleton):
    """(N, P, 3) points a centimetre apart along forearms, palms and fingers."""
    at, found = skeleton.origins, []
    for side in (0, 1):
        elbow, wrist = (at[:, arm_rows(bone)[side]] for bone in (Bone.FOREARM, Bone.HAND))
        chains = [[elbow, wrist]]
        first = Bone.FINGERS + 15 * side
        chains += [[wrist, *(at[:, first + 3 * f + k] for k in range(3))] for f in range(5)]
        for chain in chains:
            for a, b in pairwise(chain):
                steps = 26 if chain[0] is elbow else 6
                found += [a + t * (b - a) for t in np.linspace(0.0, 1.0, steps)]
    return np.stack(found, axis=1)


def people_in(solids, rng, count):
    """Goals of people who stand freely between solids and hold their hands anywhere."""
    tried = 3 * count
    goals = unknown(tried)
    low, high = solids.centres.min(axis=0)[:2] + 0.3, solids.centres.max(axis=0)[:2] - 0.3
    goals.eyes[:, :2] = rng.uniform(low, high, (tried, 2))
    goals.eyes[:, 2] = rng.uniform(1.4, 1.8, tried)
    yaw, pitch = rng.uniform([-np.pi, -0.5], [np.pi, 0.9], (tried, 2)).T
    goals.heads[:] = rotation_of(yaw, pitch, roll=0 * yaw)
    goals.wrists[:] = goals.eyes[:, None] + rng.uniform(-1, 1, (tried, 2, 3)) * (0.8, 0.8, 0.9)
    goals.wrists[..., 2] -= 0.3
    # Nobody stands in furniture: trunk and shoulders are a hand's width clear of it.
    _, skeleton = solve_bodies(None, goals)
    rows = [Bone.PELVIS, Bone.CHEST, Bone.NECK, Bone.HEAD, *arm_rows(Bone.UPPER_ARM)]
    wide = Solids(solids.centres, solids.rotations, solids.halves + 0.2)
    free = np.flatnonzero(wide.depths(skeleton.origins[:, rows]).max(axis=1) <= 0.0)[:count]
    assert len(free) == count
    return replace(goals, **{name: getattr(goals, name)[free] for name in type(goals).__slots__})


@pytest.mark.parametrize(
    "seeds", [1, pytest.param(20, marks=pytest.mark.slow)], ids=["few", "many"]
)
@pytest.mark.parametrize("name", ["lab", "desk"])
def test_nobody_s_arm_goes_through_furniture(name, seeds):
    solids = solids_of(unlit_room(name).solids)
    for seed in range(seeds):
        assert_clear(solids, people_in(solids, np.random.default_rng(seed), 500))


def assert_clear(solids, goals):
    _, free = solve_bodies(None, goals)
    _, skeleton = solve_bodies(None, goals, solids=solids)
    through = (solids.depths(dense(free)).max(axis=1) > MAX_DEPTH_M).mean()
    assert through > 0.03, "furniture is in the way"
    assert solids.depths(dense(skeleton)).max() <= MAX_DEPTH_M + 1e-6
    for side in (0, 1):
        shoulder, elbow, wrist = (
            skeleton.origins[:, arm_rows(bone)[side]]
            for bone in (Bone.UPPER_ARM, Bone.FOREARM, Bone.HAND)
        )
        upper, fore = unit(elbow - shoulder), unit(wrist - elbow)
        bend = np.arctan2(length(cross(upper, fore)), dot(upper, fore))
        assert ELBOW.excess(bend).max() < 1e-6


def test_a_crowd_keeps_its_hands_out_of_a_table_that_was_moved():
    table = Furniture(no_solids(), {"table-1": solids_of([TABLE])}, {})
    head = Pose(np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float), np.array([-0.6, 0, 1.6]))
    hand = np.array([[-0.2, 0.1, 0.73]])
    person = {"ana": Avatar("ana", "local", head, (hand, hand * (1, -1, 1)))}
    where = {"table-1": Pose.identity()}
    free = Crowd(table).figures(person, 1)["ana"]
    kept = Crowd(table).figures(person, 1, objects=where)["ana"]
    solids = table.at(where)
    deep = [solids.depths(each.vertices.astype(float)).max() for each in (free, kept)]
    assert deep[0] > 0.015
    assert deep[1] < 0.02, "skin is thicker than bones"
