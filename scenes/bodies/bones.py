"""Skeletons laid out: joints of torso, arms, legs and hands to origins and rotations of bones."""

from __future__ import annotations

from functools import cache

import numpy as np

from scenes.bodies.arms import Arms
from scenes.bodies.hands import REST, fingers, rest_palm
from scenes.bodies.skeleton import (
    ANKLE_M,
    BONES,
    FINGER_BONES,
    SIDES,
    Bone,
    Skeleton,
    arm_rows,
    leg_rows,
    rest_arm,
    rest_joints,
)
from scenes.bodies.torso import Torso, rotation_of
from scenes.bodies.vectors import Array, about, frame, packed, turned, unit

TOES_DOWN_PER_M, MAX_TOES_DOWN_RAD = 5.0, 0.9
"""How far toes point down for each metre that an ankle is lifted, radians, and the most: a heel
leaves the floor before the toes do."""

PALM, FOREARM = np.array([0.25, 0.5, 0.75]), np.arange(1, 13) / 12
"""Shares of the ways from the wrist to the knuckles and to the elbow at which solids are looked
for: 2 cm apart."""

DOWN = np.array([0.0, 0.0, -1.0])
"""(3,) along a leg at rest."""

AHEAD = np.array([1.0, 0.0, 0.0])
"""(3,) ahead of a person at rest."""


@cache
def rest_skeleton() -> Skeleton:
    """Return the reference person at rest: every rotation is the identity."""
    origins = np.zeros((BONES, 3))
    joints = rest_joints()
    origins[: Bone.FINGERS] = joints
    places, _ = fingers(np.broadcast_to(REST, (2, *REST.shape)))
    palms = rest_palm()
    wrists = joints[arm_rows(Bone.HAND)]
    at = wrists[:, None, None] + np.einsum("mij,mfsj->mfsi", palms, places[:, :, :3])
    origins[Bone.FINGERS :] = at.reshape(-1, 3)
    return Skeleton(origins[None], np.tile(np.eye(3), (1, BONES, 1, 1)), np.ones(1))


def laid_out(
    torso: Torso,
    arms: Arms,
    *,
    clavicles: tuple[Array, Array, Array],
    legs: tuple[Array, Array, Array, Array],
    angles: Array,
    scales: Array,
) -> Skeleton:
    """Return skeletons of joints that are in the reference person's metres.

    Args:
        torso: head to pelvis.
        arms: elbows to palms.
        clavicles: inner ends, shoulders and rotations.
        legs: hips, knees, ankles and yaws of feet.
        angles: (N, 2, 5, 4) of fingers.
        scales: (N,) of people over the reference person.
    """
    count = len(scales)
    origins = np.zeros((count, BONES, 3))
    rotations = np.empty((count, BONES, 3, 3))
    for bone, place, turn in (
        (Bone.PELVIS, torso.pelvis, torso.world_from_pelvis),
        (Bone.SPINE, torso.pelvis, torso.world_from_chest),
        (Bone.CHEST, torso.waist, torso.world_from_chest),
        (Bone.NECK, torso.neck, torso.world_from_neck),
        (Bone.HEAD, torso.head, torso.world_from_head),
    ):
        origins[:, bone], rotations[:, bone] = place, turn
    _lay_arms(origins, rotations, arms=arms, clavicles=clavicles)
    _lay_legs(origins, rotations, legs=legs)
    places, turns = fingers(angles)
    palms = arms.palms[:, :, None, None]
    at = arms.wrists[:, :, None, None] + turned(palms, places[..., :3, :])
    origins[:, Bone.FINGERS :] = at.reshape(count, 2 * FINGER_BONES, 3)
    back = np.swapaxes(rest_palm(), -1, -2)[:, None, None]
    rotations[:, Bone.FINGERS :] = (palms @ turns @ back).reshape(count, 2 * FINGER_BONES, 3, 3)
    return Skeleton(origins * scales[:, None, None], rotations, scales)


def arm_points(arms: Arms, angles: Array) -> Array:
    """Return (N, 2, P, 3) points of arms below the elbow that solids may stop.

    The wrist, the palm, fingers with their joints, middles of bones and tips, and the forearm: so
    close to each other that a table's top does not fit between.
    """
    places, _ = fingers(angles)
    flat = places.reshape(*places.shape[:2], -1, 3)
    palm = places[:, :, 1:, 0]
    middles = 0.5 * (places[..., 1:, :] + places[..., :-1, :]).reshape(*places.shape[:2], -1, 3)
    palms = [share * palm for share in PALM]
    flat = np.concatenate([np.zeros_like(flat[:, :, :1]), *palms, flat, middles], axis=2)
    hands = arms.wrists[:, :, None] + turned(arms.palms[:, :, None], flat)
    along = (arms.elbows - arms.wrists)[:, :, None]
    return np.concatenate([hands, arms.wrists[:, :, None] + FOREARM[:, None] * along], axis=2)


def _lay_arms(
    origins: Array, rotations: Array, *, arms: Arms, clavicles: tuple[Array, Array, Array]
) -> None:
    root, shoulders, turn = clavicles
    along, hinge, _ = rest_arm()
    rest = np.swapaxes(frame(along, hinge), -1, -2)
    upper, fore = unit(arms.elbows - shoulders), unit(arms.wrists - arms.elbows)
    # A forearm's skin turns half as far as the hand.
    half = about(fore, 0.5 * arms.pronation * SIDES, vector=arms.hinges)
    for bone, place, rotation in (
        (Bone.CLAVICLE, root, turn),
        (Bone.UPPER_ARM, shoulders, frame(upper, arms.hinges) @ rest),
        (Bone.FOREARM, arms.elbows, frame(fore, half) @ rest),
        (Bone.HAND, arms.wrists, arms.palms @ np.swapaxes(rest_palm(), -1, -2)),
    ):
        rows = arm_rows(bone)
        origins[:, rows], rotations[:, rows] = place, rotation


def _lay_legs(origins: Array, rotations: Array, *, legs: tuple[Array, Array, Array, Array]) -> None:
    hips, knees, ankles, yaw = legs
    rest = frame(DOWN, AHEAD).T
    ahead = packed(np.cos(yaw), np.sin(yaw), np.zeros_like(yaw))
    lifted = np.clip((ankles[..., 2] - ANKLE_M) * TOES_DOWN_PER_M, 0.0, MAX_TOES_DOWN_RAD)
    foot = rotation_of(yaw.ravel(), lifted.ravel(), roll=np.zeros(yaw.size)).reshape(
        *yaw.shape, 3, 3
    )
    for bone, place, rotation in (
        (Bone.THIGH, hips, frame(unit(knees - hips), ahead + 1e-3 * DOWN) @ rest),
        (Bone.SHIN, knees, frame(unit(ankles - knees), ahead + 1e-3 * DOWN) @ rest),
        (Bone.FOOT, ankles, foot),
    ):
        rows = leg_rows(bone)
        origins[:, rows], rotations[:, rows] = place, rotation
