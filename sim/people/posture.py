"""Poses of a person's limbs: walking legs, bent knees and back, arms that reach for objects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.pose import Pose

Vector = NDArray[np.float64]

PELVIS_M = 0.93
HIP_HALF_M = 0.09
ANKLE_M = 0.075
THIGH_M = 0.43
SHIN_M = 0.435
SPINE_M = 0.50
SHOULDER_DROP_M = 0.06
SHOULDER_HALF_M = 0.178
UPPER_ARM_M = 0.29
FOREARM_M = 0.26
WRIST_GAP_M = 0.07
FULL_STRIDE_M = 1.30
WALKING_SPEED_M_S = 1.15
STANCE = 0.6
SEAT_BACK_M = 0.42
"""How far behind the feet somebody sits: a thigh's length."""
PELVIS_ON_SEAT_M = 0.10
"""Height of the hips above what is sat on."""
MAX_LEAN_RAD = 1.15
MAX_CROUCH_M = 0.30
HAND_REACH_M = 0.94 * (UPPER_ARM_M + FOREARM_M) + WRIST_GAP_M
"""How far from the shoulder a hand still gets, metres: an arm that is nearly straight."""
ESTIMATE_ERROR_M = 1e-9
"""Far more than an estimated distance between a shoulder and a hand is off by rounding, metres."""
SIDES = (1.0, -1.0)
"""Left, right: signs of the person's y axis (x forward, y left, z up)."""

PART_NAMES: tuple[str, ...] = (
    "pelvis", "torso", "head",
    "left-upper-arm", "left-forearm", "left-hand",
    "right-upper-arm", "right-forearm", "right-hand",
    "left-thigh", "left-shin", "left-shoe",
    "right-thigh", "right-shin", "right-shoe",
)  # fmt: skip
HEAD = PART_NAMES.index("head")

FACE_IN_HEAD = np.array([0.06, 0.0, 0.13])
"""(3,) place between the eyes in the head's axes, metres."""


@dataclass(frozen=True, slots=True)
class Bend:
    """One of the ways to bend down, from upright to as far as it goes.

    Attributes:
        lean_rad: how far the back is bent forward.
        crouch_m: how far the hips are lowered.
        shoulder_x_m: of the shoulders, forward of the feet.
        shoulder_z_m: height of the shoulders above the floor.
    """

    lean_rad: float
    crouch_m: float
    shoulder_x_m: float
    shoulder_z_m: float

    @staticmethod
    def of_effort(effort: float) -> Bend:
        """With an effort from 0 to 1: the back first, then the knees, too."""
        lean = MAX_LEAN_RAD * effort
        crouch = MAX_CROUCH_M * (max(0.0, effort - 0.35) / 0.65)
        sine, cosine = math.sin(lean), math.cos(lean)
        height = SPINE_M - SHOULDER_DROP_M
        return Bend(lean, crouch, (height - 0.12) * sine, height * cosine + PELVIS_M - crouch)


BENDS = tuple(Bend.of_effort(float(effort)) for effort in np.linspace(0.0, 1.0, 33))
"""The bends that are tried for a reach, the least effort first; 33 are closer than can be seen."""


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Parameters of a person's shape at one instant.

    Attributes:
        position: (2,) on the floor, world metres.
        yaw: where the person faces, radians from world x.
        stride_phase: 0..1 of a full stride (two steps).
        stride_m: length of a full stride; 0 stands.
        lean_rad: how far the back is bent forward.
        crouch_m: how far the hips are lowered.
        left_hand: (3,) world metres.
        right_hand: (3,) world metres.
        seated: 0 on the feet, 1 on a seat behind them; in between on the way.
        seat_height_m: of the seat above the floor.
    """

    position: Vector
    yaw: float
    stride_phase: float
    stride_m: float
    lean_rad: float
    crouch_m: float
    left_hand: Vector
    right_hand: Vector
    seated: float = 0.0
    seat_height_m: float = 0.45


def part_poses(posture: Posture) -> tuple[Pose, ...]:
    """`world_from_part` in the order of `PART_NAMES`.

    A limb's frame has its origin at the upper joint and runs along -z to the lower one; torso and
    head stand on their origin along +z; x points forward.
    """
    world_from_person = Pose.from_yaw(posture.yaw, (*posture.position, 0.0))
    person_from_world = world_from_person.inverse()
    bob = 0.018 * posture.stride_m * math.cos(4.0 * math.pi * posture.stride_phase)
    hips = np.array([0.0, 0.0, PELVIS_M - posture.crouch_m - 0.02 * posture.stride_m + bob])
    hips[0] -= 0.12 * math.sin(posture.lean_rad)
    if posture.seated > 0.0:
        down = posture.seat_height_m + PELVIS_ON_SEAT_M - hips[2]
        hips += posture.seated * np.array([-SEAT_BACK_M, 0.0, down])
    sway = 0.12 * posture.stride_m * math.sin(2.0 * math.pi * posture.stride_phase)
    pelvis = Pose.from_yaw(0.5 * sway, hips)
    torso = Pose(_pitched(posture.lean_rad) @ Pose.from_yaw(-0.5 * sway).rotation, hips)
    head = Pose(_pitched(0.55 * posture.lean_rad), torso @ np.array([0.0, 0.0, SPINE_M + 0.035]))
    poses = [pelvis, torso, head]
    for side, hand in zip(SIDES, (posture.left_hand, posture.right_hand), strict=True):
        shoulder = torso @ _shoulder_on_spine(side)
        poses += _arm(shoulder, person_from_world @ hand, side)
    for side in SIDES:
        poses += _leg(pelvis @ np.array([0.0, side * HIP_HALF_M, -0.02]), posture, side)
    return tuple(world_from_person @ pose for pose in poses)


def resting_hand(posture: Posture, side: float) -> Vector:
    """(3,) world point where a hanging hand swings: `side` +1 left, -1 right."""
    swing = -side * math.cos(2.0 * math.pi * posture.stride_phase)
    if posture.seated > 0.5:
        knee = (0.12 - SEAT_BACK_M * posture.seated, side * 0.16, posture.seat_height_m + 0.20)
        return Pose.from_yaw(posture.yaw, (*posture.position, 0.0)) @ np.array(knee)
    local = np.array(
        [
            0.03 + 0.24 * posture.stride_m * swing,
            side * 0.245,
            0.80 + 0.06 * posture.stride_m * abs(swing) - posture.crouch_m,
        ]
    )
    return Pose.from_yaw(posture.yaw, (*posture.position, 0.0)) @ local


def bend_to_reach(position: Vector, yaw: float, left: Vector, right: Vector) -> tuple[float, float]:
    """Lean and crouch (radians, metres) with which both hands are within reach."""
    person_from_world = Pose.from_yaw(yaw, (*position, 0.0)).inverse()
    hands = [person_from_world @ left, person_from_world @ right]
    places = [hand.tolist() for hand in hands]
    for bend in BENDS:
        # A quick estimate settles nearly all of them; what it leaves open is computed in full.
        farthest = max(
            math.dist((bend.shoulder_x_m, side * SHOULDER_HALF_M, bend.shoulder_z_m), place)
            for side, place in zip(SIDES, places, strict=True)
        )
        if farthest > HAND_REACH_M + ESTIMATE_ERROR_M:
            continue
        if farthest < HAND_REACH_M - ESTIMATE_ERROR_M or _is_in_reach(bend, hands):
            return bend.lean_rad, bend.crouch_m
    return MAX_LEAN_RAD, MAX_CROUCH_M


def _is_in_reach(bend: Bend, hands: Sequence[Vector]) -> bool:
    hips = np.array([-0.12 * math.sin(bend.lean_rad), 0.0, PELVIS_M - bend.crouch_m])
    bent = Pose(_pitched(bend.lean_rad), hips)
    distances = [
        np.linalg.norm(bent @ _shoulder_on_spine(side) - hand)
        for side, hand in zip(SIDES, hands, strict=True)
    ]
    return bool(max(distances) <= HAND_REACH_M)


def _shoulder_on_spine(side: float) -> Vector:
    return np.array([0.0, side * SHOULDER_HALF_M, SPINE_M - SHOULDER_DROP_M])


def _arm(shoulder: Vector, hand: Vector, side: float) -> list[Pose]:
    towards = hand - shoulder
    wrist = hand - WRIST_GAP_M * towards / max(float(np.linalg.norm(towards)), 1e-6)
    out_and_back = np.array([-0.75, 0.55 * side, -0.35])
    elbow, wrist = _two_bones(shoulder, wrist, UPPER_ARM_M, FOREARM_M, out_and_back)
    forward = np.array([1.0, 0.0, 0.0])
    palm = wrist + (wrist - elbow) / np.linalg.norm(wrist - elbow)
    return [
        _along(shoulder, elbow, forward),
        _along(elbow, wrist, forward),
        _along(wrist, palm, forward),
    ]


def _leg(hip: Vector, posture: Posture, side: float) -> list[Pose]:
    phase = (posture.stride_phase + (0.0 if side > 0 else 0.5)) % 1.0
    half = 0.5 * STANCE * posture.stride_m
    if phase < STANCE:
        forward, lift = half * (1.0 - 2.0 * phase / STANCE), 0.0
    else:
        swing = (phase - STANCE) / (1.0 - STANCE)
        eased = swing * swing * (3.0 - 2.0 * swing)
        forward = half * (2.0 * eased - 1.0)
        lift = 0.11 * math.sin(math.pi * swing) * min(1.0, posture.stride_m)
    ankle = np.array([forward, side * HIP_HALF_M, ANKLE_M + lift])
    ahead = np.array([1.0, 0.04 * side, 0.0])
    knee, ankle = _two_bones(hip, ankle, THIGH_M, SHIN_M, ahead)
    tilt = -2.2 * lift if phase > STANCE else 0.0
    return [
        _along(hip, knee, ahead),
        _along(knee, ankle, ahead),
        Pose(_pitched(-tilt) @ Pose.from_yaw(0.12 * side).rotation, ankle),
    ]


def _two_bones(
    root: Vector, target: Vector, first: float, second: float, pole: Vector
) -> tuple[Vector, Vector]:
    """Middle joint and reached end of a two-bone limb that bends towards `pole`."""
    towards = target - root
    distance = float(np.linalg.norm(towards))
    reached = min(max(distance, abs(first - second) + 1e-3), first + second - 1e-3)
    axis = towards / max(distance, 1e-6)
    along = (first**2 - second**2 + reached**2) / (2.0 * reached)
    out = math.sqrt(max(first**2 - along**2, 0.0))
    side = pole - (pole @ axis) * axis
    side = side / max(float(np.linalg.norm(side)), 1e-6)
    return root + along * axis + out * side, root + reached * axis


def _along(upper: Vector, lower: Vector, forward: Vector) -> Pose:
    """Frame at `upper` whose -z runs to `lower` and whose x is as near to `forward` as may be."""
    z = (upper - lower) / np.linalg.norm(upper - lower)
    helper = forward if abs(float(forward @ z)) < 0.95 else np.array([0.0, 0.0, 1.0])
    x = helper - (helper @ z) * z
    x = x / np.linalg.norm(x)
    return Pose(np.stack([x, np.cross(z, x), z], axis=1), upper)


def _pitched(angle_rad: float) -> NDArray[np.float64]:
    """Bend forward about the person's y axis."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def head_camera(world_from_head: Pose) -> Pose:
    """The head as a camera (x right, y down, z forward); its own x is forward and z up."""
    level = Pose.from_yaw(-0.5 * math.pi) @ WORLD_FROM_FORWARD_CAMERA
    return world_from_head @ Pose(level.rotation, FACE_IN_HEAD)
