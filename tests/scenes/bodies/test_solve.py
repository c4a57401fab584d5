"""Bodies solved from random heads and hands: bones, joints, solids, feet, smoothness."""

from itertools import pairwise

import numpy as np
import pytest

from scenes.bodies.arms import MAX_REACH_M, MIN_REACH_M, cone_angles, cone_limit, twist_of
from scenes.bodies.bones import rest_skeleton
from scenes.bodies.goals import unknown
from scenes.bodies.hands import FINGERS, RELAXED, fingers, rest_palm
from scenes.bodies.skeleton import (
    ELBOW,
    HIP_ABDUCTION,
    HIP_FLEXION,
    HUMERAL_TWIST,
    KNEE,
    SIDES,
    Bone,
    arm_rows,
    leg_rows,
)
from scenes.bodies.solids import MAX_DEPTH_M, Solids
from scenes.bodies.solve import solve_bodies
from scenes.bodies.torso import rotation_of
from scenes.bodies.vectors import across, back, cross, dot, length, turned, unit, yaw_rotation

COUNT = 10_000
SLACK_RAD = 1e-6
ARM = (Bone.CLAVICLE, Bone.UPPER_ARM, Bone.FOREARM, Bone.HAND)
LEG = (Bone.THIGH, Bone.SHIN, Bone.FOOT)
TRUNK = (Bone.SPINE, Bone.CHEST, Bone.NECK, Bone.HEAD)
CHAINS = [
    TRUNK,
    *([arm_rows(bone)[side] for bone in ARM] for side in (0, 1)),
    *([leg_rows(bone)[side] for bone in LEG] for side in (0, 1)),
    *([first, first + 1, first + 2] for first in range(Bone.FINGERS, Bone.FINGERS + 30, 3)),
]
CHILDREN = [pair for chain in CHAINS for pair in pairwise(chain)]


def random_goals(rng, count=COUNT):
    """Heads that look anywhere, at any height, and hands anywhere around them, held anyhow."""
    goals = unknown(count)
    goals.eyes[:] = rng.uniform([-2, -2, 0.7], [2, 2, 1.9], (count, 3))
    yaw, pitch, roll = rng.uniform([-np.pi, -1.4, -0.8], [np.pi, 1.4, 0.8], (count, 3)).T
    goals.heads[:] = rotation_of(yaw, pitch, roll=roll)
    goals.wrists[:] = goals.eyes[:, None] + rng.uniform(-1.0, 1.0, (count, 2, 3)) * (0.9, 0.9, 1.3)
    goals.wrists[rng.random((count, 2)) < 0.1] = np.nan
    held = rng.normal(size=(count, 2, 3, 3))
    along = unit(held[..., 0])
    side = across(held[..., 1], along)
    goals.palms[:] = np.stack([along, side, cross(along, side)], axis=-1)
    goals.palms[rng.random((count, 2)) < 0.3] = np.nan
    angles = RELAXED + rng.uniform(-0.3, 0.6, (count, 2, FINGERS, 4))
    goals.fingers[:] = np.where(rng.random((count, 2, 1, 1)) < 0.5, angles, np.nan)
    return goals


@pytest.fixture(scope="module")
def solved():
    goals = random_goals(np.random.default_rng(5))
    return goals, solve_bodies(None, goals)[1]


def bends(skeleton, first, second, third):
    a, b, c = (skeleton.origins[:, row] for row in (first, second, third))
    upper, lower = unit(b - a), unit(c - b)
    return np.arctan2(length(cross(upper, lower)), dot(upper, lower))


def test_bones_are_never_stretched(solved):
    _, skeleton = solved
    rest = rest_skeleton().origins[0]
    for parent, child in CHILDREN:
        wanted = np.linalg.norm(rest[child] - rest[parent]) * skeleton.scales
        found = length(skeleton.origins[:, child] - skeleton.origins[:, parent])
        assert np.abs(found - wanted).max() < 1e-6, (parent, child)


def test_every_rotation_is_one(solved):
    _, skeleton = solved
    turn = skeleton.rotations
    assert np.abs(turn @ np.swapaxes(turn, -1, -2) - np.eye(3)).max() < 1e-6
    assert np.linalg.det(turn).min() > 0.999


def test_elbows_and_knees_bend_as_far_as_joints_do(solved):
    _, skeleton = solved
    for side in (0, 1):
        arm = [arm_rows(bone)[side] for bone in (Bone.UPPER_ARM, Bone.FOREARM, Bone.HAND)]
        leg = [leg_rows(bone)[side] for bone in (Bone.THIGH, Bone.SHIN, Bone.FOOT)]
        assert ELBOW.excess(bends(skeleton, *arm)).max() < SLACK_RAD
        assert KNEE.excess(bends(skeleton, *leg)).max() < SLACK_RAD


def test_upper_arms_stay_in_their_reach(solved):
    _, skeleton = solved
    chest = skeleton.rotations[:, Bone.CHEST]
    for side, mirror in ((0, 1.0), (1, -1.0)):
        shoulder, elbow, wrist = (
            skeleton.origins[:, arm_rows(bone)[side]]
            for bone in (Bone.UPPER_ARM, Bone.FOREARM, Bone.HAND)
        )
        upper, fore = (
            np.einsum("nji,nj->ni", chest, unit(v)) * (1, mirror, 1)
            for v in (elbow - shoulder, wrist - elbow)
        )
        angle, around = cone_angles(upper)
        assert (angle - cone_limit(around)).max() < 1e-4
        straight = (
            bends(skeleton, *(arm_rows(b)[side] for b in (Bone.UPPER_ARM, Bone.FOREARM, Bone.HAND)))
            < 0.02
        )
        assert HUMERAL_TWIST.excess(twist_of(upper, fore))[~straight].max() < 1e-4


def test_heads_are_where_they_are_seen(solved):
    goals, skeleton = solved
    neck = skeleton.origins[:, Bone.HEAD] - goals.eyes
    assert length(neck).max() < 0.13 * skeleton.scales.max()


def test_hands_within_reach_are_where_they_are_seen():
    goals = unknown(500)
    rng = np.random.default_rng(2)
    goals.wrists[:, 0] = rng.uniform([0.15, 0.0, 0.95], [0.42, 0.35, 1.45], (500, 3))
    goals.wrists[:, 1] = rng.uniform([0.15, -0.35, 0.95], [0.42, 0.0, 1.45], (500, 3))
    _, skeleton = solve_bodies(None, goals)
    shoulders = skeleton.origins[:, arm_rows(Bone.UPPER_ARM)]
    distance = length(goals.wrists - shoulders)
    reached = (distance > MIN_REACH_M) & (distance < MAX_REACH_M)
    assert reached.mean() > 0.8
    assert length(skeleton.origins[:, arm_rows(Bone.HAND)] - goals.wrists)[reached].max() < 1e-6
    elbows = skeleton.origins[:, arm_rows(Bone.FOREARM)]
    # Elbows hang: lower than the shoulder, and not in the body.
    assert (elbows[..., 2] < skeleton.origins[:, arm_rows(Bone.UPPER_ARM), 2]).mean() > 0.97
    assert (np.abs(elbows[..., 1]) > 0.12).mean() > 0.97


def boxes(rng, count=6):
    yaw = rng.uniform(-np.pi, np.pi, count)
    halves = rng.uniform(0.08, 0.3, (count, 3))
    # Nobody stands in them: a body is 0.3 m wide.
    away = rng.uniform(-np.pi, np.pi, count)
    far = np.hypot(halves[:, 0], halves[:, 1]) + rng.uniform(0.25, 0.5, count)
    centres = np.stack(
        [far * np.cos(away), far * np.sin(away), rng.uniform(0.3, 1.5, count)], axis=1
    )
    return Solids(centres, yaw_rotation(yaw), halves)


@pytest.mark.parametrize("count", [COUNT // 10, pytest.param(COUNT, marks=pytest.mark.slow)])
def test_no_hand_is_further_than_a_centimetre_in_a_solid(count):
    rng = np.random.default_rng(8)
    deepest, moved, at_once = 0.0, 0, count // 20
    for _ in range(20):
        goals, solids = random_goals(rng, at_once), boxes(rng)
        goals.eyes[:, :2], goals.eyes[:, 2] = 0.0, rng.uniform(1.4, 1.8, at_once)
        picked = rng.integers(len(solids.centres), size=(at_once, 2))
        inside = rng.uniform(-1.0, 1.0, (at_once, 2, 3)) * solids.halves[picked]
        goals.wrists[:] = solids.centres[picked] + turned(solids.rotations[picked], inside)
        _, free = solve_bodies(None, goals)
        _, skeleton = solve_bodies(None, goals, solids=solids)
        points = hand_points(skeleton)
        deepest = max(deepest, float(solids.depths(points).max()))
        before = solids.depths(hand_points(free))
        moved += int((before.max(axis=1) > MAX_DEPTH_M).sum())
        stretch = length(skeleton.origins[:, 7] - skeleton.origins[:, 8])
        assert np.ptp(stretch / skeleton.scales) < 1e-6
    assert moved > count // 10, "the boxes are in the way"
    assert deepest <= MAX_DEPTH_M + 1e-6


def hand_points(skeleton):
    """(N, P, 3) wrists and joints of fingers, with tips."""
    origins, scales = skeleton.origins, skeleton.scales
    wrists = origins[:, arm_rows(Bone.HAND)]
    joints = origins[:, Bone.FINGERS :]
    last = joints.reshape(len(scales), 2, 5, 3, 3)[..., 2, :]
    turn = skeleton.rotations[:, Bone.FINGERS :].reshape(len(scales), 2, 5, 3, 3, 3)[..., 2, :, :]
    places, _ = fingers(np.zeros((2, FINGERS, 4)))
    step = places[..., 3, :] - places[..., 2, :]
    rest = np.einsum("mij,mfj->mfi", rest_palm(), step)
    tips = last + np.einsum("nmfij,mfj->nmfi", turn, rest) * scales[:, None, None, None]
    return np.concatenate([wrists, joints, tips.reshape(len(scales), -1, 3)], axis=1)


def walk(speed, seconds=4.0, rate=72):
    """Feet's places of somebody who walks ahead, a row a moment."""
    goals, state, seen = unknown(1), None, []
    for k in range(int(seconds * rate)):
        goals.eyes[0, 0] = speed * k / rate
        state, skeleton = solve_bodies(state, goals, dt_s=1.0 / rate)
        seen.append(skeleton.origins[0, leg_rows(Bone.FOOT)])
    return np.array(seen), goals


def test_feet_stay_planted_and_step_after_the_body():
    seen, goals = walk(0.7)
    pace = np.linalg.norm(np.diff(seen[..., :2], axis=0), axis=-1)
    assert (pace < 1e-4).mean() > 0.25, "a foot on the floor does not slide"
    assert ((pace[40:] < 1e-4).any(axis=1)).mean() > 0.9, "one of both is on the floor"
    assert np.abs(seen[-1, :, 0] - goals.eyes[0, 0]).max() < 0.75
    assert pace.max() * 72 < 6.0, "feet do not jump"
    still, _ = walk(0.0, seconds=1.0)
    assert np.ptp(still, axis=0).max() < 1e-9


def test_a_jump_puts_the_feet_down_below():
    goals = unknown(1)
    state, _ = solve_bodies(None, goals)
    goals.eyes[0, :2] = (5.0, 3.0)
    _, skeleton = solve_bodies(state, goals, dt_s=0.014)
    assert np.abs(skeleton.origins[0, leg_rows(Bone.FOOT), :2] - (5.0, 3.0)).max() < 0.4


def test_small_changes_of_hands_make_small_changes_of_bodies():
    rng = np.random.default_rng(1)
    goals, state, worst = unknown(40), None, 0.0
    # Before the body: no hand goes through a chest or a shoulder.
    start = goals.eyes[:, None] + rng.uniform(-0.3, 0.3, (40, 2, 3)) + (0.38, 0, -0.4)
    way = rng.uniform(-0.2, 0.2, start.shape) * (0.5, 1.0, 1.0)
    before = None
    for k in range(72):
        goals.wrists[:] = start + way * np.sin(k / 72 * 2 * np.pi)
        state, skeleton = solve_bodies(state, goals, dt_s=1 / 72)
        if before is not None:
            worst = max(worst, float(length(skeleton.origins - before)[:, :19].max()))
        before = skeleton.origins
    assert worst < 0.10, "metres in a 72nd of a second"


def test_a_hand_that_goes_away_sinks():
    goals = unknown(1)
    goals.wrists[0, 0] = (0.4, 0.2, 1.4)
    state, first = solve_bodies(None, goals)
    goals.wrists[:] = np.nan
    heights = [first.origins[0, Bone.HAND, 2]]
    for _ in range(40):
        state, skeleton = solve_bodies(state, goals, dt_s=1 / 72)
        heights.append(skeleton.origins[0, Bone.HAND, 2])
    assert heights[0] > 1.3
    assert heights[-1] < 0.95
    assert np.abs(np.diff(heights)).max() < 0.06


def test_who_hovers_has_hanging_legs_and_who_is_low_bends():
    goals = unknown(3)
    goals.eyes[:, 2] = (1.6, 3.0, 1.0)
    _, skeleton = solve_bodies(None, goals)
    feet = skeleton.origins[:, leg_rows(Bone.FOOT), 2]
    assert feet[0].max() < 0.08
    assert feet[1].min() > 1.0
    assert feet[2].max() < 0.08
    knees = [float(bends(skeleton, *(leg_rows(b)[0] for b in (13, 14, 15)))[k]) for k in (0, 2)]
    assert knees[0] < 0.5 < knees[1]


def hips(skeleton):
    """Flexion and abduction of both thighs, (N, 2) each, radians."""
    thigh, knee = (skeleton.origins[:, leg_rows(bone)] for bone in (Bone.THIGH, Bone.SHIN))
    local = back(skeleton.rotations[:, [Bone.PELVIS]], unit(knee - thigh))
    flexion = np.arctan2(local[..., 0], -local[..., 2])
    return flexion, np.arcsin(np.clip(local[..., 1] * SIDES, -1.0, 1.0))


def test_thighs_stay_within_what_hips_do(solved):
    _, skeleton = solved
    flexion, abduction = hips(skeleton)
    assert HIP_FLEXION.excess(flexion).max() < 1e-4
    assert HIP_ABDUCTION.excess(abduction).max() < 1e-4
    assert flexion.max() > 0.95 * HIP_FLEXION.high, "some squat as deep as they can"


def test_who_dashes_about_keeps_hips_and_knees_within_limits_and_feet_on_the_floor():
    rng = np.random.default_rng(1)
    goals, state = unknown(100), None
    place, yaw, height = np.zeros((100, 2)), np.zeros(100), np.full(100, 1.6)
    for k in range(240):
        if k % 40 == 0:
            speed, spin = rng.normal(0, 0.9, (100, 2)), rng.normal(0, 1.5, 100)
            low, pitch = rng.uniform(0.75, 1.7, 100), rng.uniform(-0.8, 1.2, 100)
        place, yaw = place + speed / 72, yaw + spin / 72
        height = height + np.clip(low - height, -1 / 72, 1 / 72)
        goals.eyes[:, :2], goals.eyes[:, 2] = place, height
        goals.heads[:] = rotation_of(yaw, pitch, roll=0 * yaw)
        state, skeleton = solve_bodies(state, goals, dt_s=1 / 72)
        flexion, abduction = hips(skeleton)
        assert HIP_FLEXION.excess(flexion).max() < 1e-4
        assert HIP_ABDUCTION.excess(abduction).max() < 1e-4
        for side in (0, 1):
            leg = [leg_rows(bone)[side] for bone in (Bone.THIGH, Bone.SHIN, Bone.FOOT)]
            assert KNEE.excess(bends(skeleton, *leg)).max() < 1e-4
        assert skeleton.origins[:, leg_rows(Bone.FOOT), 2].min() > 0.02
