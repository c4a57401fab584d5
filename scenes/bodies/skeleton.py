"""Bones of a person: their names, lengths for an eye height, limits of their joints.

Axes of a person: x ahead, y to the left, z up. At rest every bone's own axes are these: a person
stands with arms held 45 degrees away from the body. Lengths are fractions of a standing person's
height (Drillis and Contini 1966, in Winter, *Biomechanics and Motor Control of Human Movement*);
limits of joints are normal ranges of motion (American Academy of Orthopaedic Surgeons 1965).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from scenes.bodies.vectors import Array

EYE_M = 1.60
"""Eye height of the reference person, metres: halfway between women's and men's mean in
NASA-STD-3000. A person of another eye height is this one scaled."""

HEIGHT_M = EYE_M / 0.936
"""Standing height of the reference person, metres: eyes are at 0.936 of it."""

MIN_EYE_M, MAX_EYE_M = 1.35, 2.0
"""Eye heights of people that are drawn, metres; who is lower bends, who is higher hovers."""

UPPER_ARM_M, FOREARM_M = 0.186 * HEIGHT_M, 0.146 * HEIGHT_M
"""Shoulder to elbow, elbow to wrist, metres."""

THIGH_M, SHIN_M, ANKLE_M = 0.245 * HEIGHT_M, 0.246 * HEIGHT_M, 0.039 * HEIGHT_M
"""Hip to knee, knee to ankle, ankle over the floor, metres."""

LUMBAR_M, THORAX_M, NECK_M = 0.17, 0.33, 0.10
"""Pelvis to waist, waist to the base of the neck, neck, metres: they add up to the eyes' height."""

NECK_UP = NECK_M * np.array([math.sin(0.2), 0.0, math.cos(0.2)])
"""(3,) from the base of the neck to the head's joint at rest, metres: necks lean ahead by 11
degrees."""

EYES_IN_HEAD = np.array([0.09, 0.0, 0.07])
"""(3,) point between the eyes from the joint between neck and head, metres."""

SHOULDER_IN_CHEST = np.array([0.0, 0.172, -0.060])
"""(3,) left shoulder from the base of the neck, metres."""

STERNUM_IN_CHEST = np.array([0.02, 0.025, -0.060])
"""(3,) inner end of the left collarbone from the base of the neck, metres."""

HIP_IN_PELVIS = np.array([0.0, 0.09, -0.035])
"""(3,) left hip from the pelvis, metres: standing, knees are bent by some degrees."""

REST_ARM_RAD = math.radians(45.0)
"""Angle of an arm at rest from hanging straight down."""

SIDES = np.array([1.0, -1.0])
"""(2,) sign of y on the left and on the right."""


class Bone(IntEnum):
    """Rows of a skeleton's arrays; of arms, legs and fingers the left one comes first."""

    PELVIS = 0
    SPINE = 1
    CHEST = 2
    NECK = 3
    HEAD = 4
    CLAVICLE = 5
    UPPER_ARM = 6
    FOREARM = 7
    HAND = 8
    THIGH = 13
    SHIN = 14
    FOOT = 15
    FINGERS = 19


ARM_BONES, LEG_BONES, FINGER_BONES = 4, 3, 15
"""Bones of an arm from the collarbone, of a leg, of the fingers of a hand."""

BONES = Bone.FINGERS + 2 * FINGER_BONES
"""Rows of a skeleton's arrays."""


@dataclass(frozen=True, slots=True)
class Range:
    """Limits of an angle, radians."""

    low: float
    high: float

    @staticmethod
    def degrees(low: float, high: float) -> Range:
        """Return limits that are given in degrees."""
        return Range(math.radians(low), math.radians(high))

    def clip(self, angle: Array) -> Array:
        """Return angles within the limits."""
        return np.clip(angle, self.low, self.high)

    def excess(self, angle: Array) -> Array:
        """Return how far angles are outside, radians; 0 within."""
        return np.maximum(self.low - angle, 0.0) + np.maximum(angle - self.high, 0.0)


ELBOW = Range.degrees(0.0, 145.0)
"""Flexion of an elbow: 150 in the reference; muscles of a sleeve touch before."""

KNEE = Range.degrees(0.0, 150.0)
"""Flexion of a knee: 135 in the reference, 150 in a deep squat."""

HIP_FLEXION = Range.degrees(-30.0, 120.0)
"""Of a thigh against the pelvis, ahead is positive."""

HIP_ABDUCTION = Range.degrees(-30.0, 45.0)
"""Of a thigh against the pelvis sideways, outwards is positive."""

PRONATION = Range.degrees(-80.0, 80.0)
"""Turn of a forearm from thumb up: palm down is positive."""

WRIST_FLEXION = Range.degrees(-70.0, 80.0)
"""Of a wrist, towards the palm."""

WRIST_DEVIATION = Range.degrees(-20.0, 30.0)
"""Of a wrist sideways, towards the little finger."""

HUMERAL_TWIST = Range.degrees(-110.0, 90.0)
"""Turn of the upper arm about itself from a forearm bent inwards, inwards is positive: 70 inwards
and 90 outwards in the reference, and 20 of the shoulder blade each."""

CHEST_TURN = Range.degrees(-35.0, 35.0)
"""Of the chest against the pelvis, about the spine."""

NECK_TURN = Range.degrees(-70.0, 70.0)
"""Of the head against the chest, about the spine."""

NECK_PITCH = Range.degrees(-60.0, 70.0)
"""Of head and neck against the chest, down is positive."""

NECK_ROLL = Range.degrees(-40.0, 40.0)
"""Of the head to a shoulder."""

SHOULDER_AXIS = np.array([math.sqrt(0.5), math.sqrt(0.5), 0.0])
"""(3,) middle of what an arm reaches: halfway between ahead and the left, in the chest's axes."""

SHOULDER_CONE_DEG = np.array(
    [
        [0, 90],
        [45, 92],
        [90, 100],
        [135, 92],
        [180, 92],
        [219, 127],
        [270, 100],
        [315, 92],
        [360, 90],
    ],
    dtype=np.float64,
)
"""(9, 2) how far an upper arm gets from that axis, in which direction around it; degrees.
Direction 0 is across the chest (horizontal adduction 135), 90 overhead (flexion 180), 180 behind
the shoulder (horizontal abduction 45), 219 down and back (extension 60), 270 hanging."""

FINGER_SPREAD = Range.degrees(-22.0, 22.0)
"""Of a finger or the thumb sideways."""

FINGER_FLEXION = (
    Range.degrees(-30.0, 90.0),
    Range.degrees(-5.0, 105.0),
    Range.degrees(-10.0, 85.0),
)
"""Of a finger's three joints from the knuckle."""


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """Bones of N people at one instant.

    Attributes:
        origins: (N, BONES, 3) upper joint of each bone, world metres.
        rotations: (N, BONES, 3, 3) world from each bone's own axes.
        scales: (N,) size of a person over the reference person's.
    """

    origins: Array
    rotations: Array
    scales: Array


def arm_rows(bone: int) -> list[int]:
    """Return the rows of a bone of the left and of the right arm."""
    return [bone, bone + ARM_BONES]


def leg_rows(bone: int) -> list[int]:
    """Return the rows of a bone of the left and of the right leg."""
    return [bone, bone + LEG_BONES]


def mirrored(left: Array) -> Array:
    """Return (2, 3): a left point, and the same on the right."""
    return np.stack([left, left * (1.0, -1.0, 1.0)])


def rest_arm() -> tuple[Array, Array, Array]:
    """Return (2, 3) each: where a resting arm points, its elbow's axis, the back of its hand."""
    c, s = math.cos(REST_ARM_RAD), math.sin(REST_ARM_RAD)
    side, o = SIDES, np.zeros(2)
    along = np.stack([o, side * s, o - c], axis=1)
    hinge = np.stack([o, o - c, -side * s], axis=1)
    dorsal = np.stack([o, side * c, o + s], axis=1)
    return along, hinge, dorsal


def rest_joints() -> Array:
    """Return (FINGERS, 3): upper joints of all bones but the fingers', at rest, from the floor."""
    found = np.zeros((Bone.FINGERS, 3))
    neck_z = EYE_M - EYES_IN_HEAD[2] - NECK_UP[2]
    found[Bone.PELVIS, 2] = found[Bone.SPINE, 2] = neck_z - THORAX_M - LUMBAR_M
    found[Bone.CHEST, 2] = neck_z - THORAX_M
    found[Bone.NECK, 2] = neck_z
    found[Bone.HEAD] = found[Bone.NECK] + NECK_UP
    neck, along = found[Bone.NECK], rest_arm()[0]
    shoulder = neck + mirrored(SHOULDER_IN_CHEST)
    found[arm_rows(Bone.CLAVICLE)] = neck + mirrored(STERNUM_IN_CHEST)
    found[arm_rows(Bone.UPPER_ARM)] = shoulder
    found[arm_rows(Bone.FOREARM)] = shoulder + UPPER_ARM_M * along
    found[arm_rows(Bone.HAND)] = shoulder + (UPPER_ARM_M + FOREARM_M) * along
    hip = found[Bone.PELVIS] + mirrored(HIP_IN_PELVIS)
    down = np.array([0.0, 0.0, 1.0])
    found[leg_rows(Bone.THIGH)] = hip
    found[leg_rows(Bone.SHIN)] = hip - THIGH_M * down
    found[leg_rows(Bone.FOOT)] = hip - (THIGH_M + SHIN_M) * down
    return found
