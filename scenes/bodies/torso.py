"""Head, neck, spine and pelvis: they hang from the eyes, which are where a headset says."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.bodies.skeleton import (
    ANKLE_M,
    CHEST_TURN,
    EYE_M,
    EYES_IN_HEAD,
    LUMBAR_M,
    NECK_PITCH,
    NECK_ROLL,
    NECK_TURN,
    NECK_UP,
    SHIN_M,
    SHOULDER_IN_CHEST,
    SIDES,
    STERNUM_IN_CHEST,
    THIGH_M,
    THORAX_M,
    mirrored,
)
from scenes.bodies.vectors import (
    Array,
    back,
    cross,
    dot,
    frame,
    length,
    packed,
    smooth,
    turned,
    unit,
    wrapped,
    yaw_rotation,
)

BACK_M = LUMBAR_M + THORAX_M
"""Pelvis to the base of the neck, metres: the back is straight."""

STANDING_PELVIS_M = float(EYE_M - EYES_IN_HEAD[2] - NECK_UP[2]) - BACK_M
"""Height of the pelvis of the reference person who stands, metres."""

MIN_PELVIS_M = ANKLE_M + 2.0 * math.sin(math.radians(16.0)) * 0.5 * (THIGH_M + SHIN_M) + 0.035
"""Height of the pelvis in the deepest squat, metres: knees bent by 148 degrees."""

MAX_LEAN_RAD = math.radians(100.0)
"""How far the back leans from upright, ahead."""

LEAN_PER_DROP = 1.1
"""How far a person who looks ahead leans for each metre that the head goes down, radians: half of
what brings the head down by the back alone, the knees do the rest; chosen by eye."""

LOOKING_LEAN = 2.0
"""How much further who looks at the floor leans for each metre, radians: chosen by eye."""

BALANCE = 0.6
"""Share of the offset between head and feet that the back leans by: feet follow the rest."""

FEET_BELOW = 0.65
"""Share of the way from the neck to the pelvis, level, below which feet stand: who leans ahead is
in balance."""

MAX_BALANCE = 0.22
"""Most of that, as a slope: 12 degrees."""

SHARE_OF_CHEST = 0.35
"""Share of a turn of the head against the pelvis that the chest makes."""

MAX_SHRUG_RAD, MAX_FORWARD_RAD = math.radians(22.0), math.radians(18.0)
"""How far a collarbone goes up and forward for a hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Torso:
    """Joints and rotations of N people, in the reference person's metres.

    Attributes:
        pelvis: (N, 3).
        waist: (N, 3).
        neck: (N, 3) base of the neck.
        head: (N, 3) joint between neck and head.
        world_from_pelvis: (N, 3, 3).
        world_from_chest: (N, 3, 3).
        world_from_neck: (N, 3, 3).
        world_from_head: (N, 3, 3) within what a neck can do.
        lean: (N,) of the back from upright for balance alone, radians.
    """

    pelvis: Array
    waist: Array
    neck: Array
    head: Array
    world_from_pelvis: Array
    world_from_chest: Array
    world_from_neck: Array
    world_from_head: Array
    lean: Array


def head_angles(heads: Array) -> tuple[Array, Array, Array]:
    """Return yaw, pitch (down is positive) and roll (to the right) of heads (N, 3, 3), radians.

    The yaw is defined for who looks straight up or down, too: the top of the head points ahead or
    back then.
    """
    ahead, left, up = heads[:, :, 0], heads[:, :, 1], heads[:, :, 2]
    way = ahead[:, :2] - ahead[:, 2:] * up[:, :2]
    yaw = np.arctan2(way[:, 1], way[:, 0])
    pitch = -np.arcsin(np.clip(ahead[:, 2], -1.0, 1.0))
    level = packed(-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw))
    # The angle about the line of sight from level to the ears.
    roll = np.arctan2(dot(cross(level, left), ahead), dot(level, left))
    return yaw, pitch, roll


def rotation_of(yaw: Array, pitch: Array, *, roll: Array) -> Array:
    """Return rotations (N, 3, 3) of the angles that `head_angles` gives."""
    c, s, o = np.cos(pitch), np.sin(pitch), np.zeros_like(pitch)
    ahead = packed(c, o, -s)
    above = packed(s, o, c)
    left = packed(o, o + 1.0, o)
    cr, sr = np.cos(roll)[:, None], np.sin(roll)[:, None]
    local = packed(ahead, cr * left + sr * above, cr * above - sr * left)
    return yaw_rotation(yaw) @ local


def torso_of(eyes: Array, heads: Array, *, facing: Array, feet: Array) -> Torso:
    """Return head to pelvis of N people, in the reference person's metres.

    Args:
        eyes: (N, 3).
        heads: (N, 3, 3).
        facing: (N,) yaw of the pelvis, radians.
        feet: (N, 2) middle between both feet.
    """
    yaw, pitch, roll = head_angles(heads)
    turn = wrapped(yaw - facing)
    chest_turn = CHEST_TURN.clip(SHARE_OF_CHEST * turn)
    roll = NECK_ROLL.clip(roll)
    # The neck's base depends on the lean, and the lean on the neck's height: twice is close enough,
    # since bones are laid out from the head down afterwards.
    neck_yaw = facing + 0.5 * (chest_turn + turn)
    head_yaw = facing + chest_turn + NECK_TURN.clip(turn - chest_turn)

    def hung(lean: Array) -> tuple[Array, Array, Array, Array]:
        """Return head and neck, and their rotations, above a back that leans so far."""
        nod = np.clip(pitch, lean + NECK_PITCH.low, lean + NECK_PITCH.high)
        head_rotation = rotation_of(head_yaw, nod, roll=roll)
        neck_rotation = rotation_of(neck_yaw, 0.5 * (lean + nod), roll=0.5 * roll)
        head = eyes - turned(head_rotation, EYES_IN_HEAD)
        return head, head - turned(neck_rotation, NECK_UP), head_rotation, neck_rotation

    lean = _lean(hung(np.zeros(len(eyes)))[1][:, 2], pitch)
    head, neck, head_rotation, neck_rotation = hung(lean)
    lean = _lean(neck[:, 2], pitch)
    spine = _back(neck, lean, facing=facing, feet=feet)
    chest = _upright(spine, facing + chest_turn)
    hips = _upright(unit(spine + _UP), facing)
    return Torso(
        pelvis=neck - BACK_M * spine,
        waist=neck - THORAX_M * spine,
        neck=neck,
        head=head,
        world_from_pelvis=hips,
        world_from_chest=chest,
        world_from_neck=neck_rotation,
        world_from_head=head_rotation,
        lean=lean,
    )


def middle_below(torso: Torso, facing: Array) -> Array:
    """Return (N, 2) where the middle between both feet belongs."""
    way = packed(np.cos(facing), np.sin(facing))
    return torso.neck[:, :2] - (FEET_BELOW * BACK_M * np.sin(torso.lean))[:, None] * way


def _lean(neck_m: Array, pitch: Array) -> Array:
    """Return (N,) how far the back leans for the height of the neck's base, radians."""
    drop = STANDING_PELVIS_M + BACK_M - neck_m
    down = smooth(pitch / math.radians(60.0))
    lean = np.maximum(drop, 0.0) * (LEAN_PER_DROP + LOOKING_LEAN * down)
    # A back that leans further than the head is down would lift the pelvis over its height.
    steepest = np.arccos(np.clip((neck_m - STANDING_PELVIS_M) / BACK_M, -1.0, 1.0))
    flattest = np.arccos(np.clip((neck_m - MIN_PELVIS_M) / BACK_M, -1.0, 1.0))
    return np.minimum(np.maximum(np.minimum(lean, steepest), flattest), MAX_LEAN_RAD)


def _back(neck: Array, lean: Array, *, facing: Array, feet: Array) -> Array:
    """Return (N, 3) the unit vector up the back: leaning ahead, and towards where feet are not."""
    c, s = np.cos(facing), np.sin(facing)
    way = packed(c * np.sin(lean), s * np.sin(lean))
    offset = BALANCE * (neck[:, :2] - feet - FEET_BELOW * BACK_M * way) / BACK_M
    far = length(offset)
    offset *= (MAX_BALANCE * np.tanh(far / MAX_BALANCE) / np.maximum(far, 1e-9))[:, None]
    # Somebody deep down keeps the height that the lean gives.
    offset *= np.cos(lean)[:, None].clip(0.0)
    return unit(np.concatenate([way + offset, np.cos(lean)[:, None]], axis=-1))


def _upright(up: Array, yaw: Array) -> Array:
    """Return rotations (N, 3, 3) with z along `up` and y as a person faces who turns by `yaw`."""
    left = packed(-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw))
    made = frame(up, left)
    # frame's columns are up, left, up × left = -ahead.
    return packed(-made[..., 2], made[..., 1], made[..., 0])


def shoulders_of(torso: Torso, wrists: Array) -> tuple[Array, Array, Array]:
    """Return inner ends of collarbones (N, 2, 3), shoulders (N, 2, 3), collarbones' rotations.

    A hand far up lifts its shoulder, one far ahead takes it along.

    Args:
        torso: of N people.
        wrists: (N, 2, 3) where hands go.
    """
    chest = torso.world_from_chest[:, None]
    fixed = torso.neck[:, None] + turned(chest, mirrored(SHOULDER_IN_CHEST))
    root = torso.neck[:, None] + turned(chest, mirrored(STERNUM_IN_CHEST))
    towards = back(chest, wrists - fixed) / 0.55
    up = MAX_SHRUG_RAD * smooth(towards[..., 2] + 0.1)
    forward = MAX_FORWARD_RAD * smooth(towards[..., 0] - 0.35)
    # About x for up, about z for forward: signs mirror between left and right.
    roll, yaw = SIDES * up, -SIDES * forward
    lifted = np.zeros((*roll.shape, 3, 3))
    lifted[..., 0, 0] = 1.0
    lifted[..., 1, 1] = lifted[..., 2, 2] = np.cos(roll)
    lifted[..., 2, 1] = np.sin(roll)
    lifted[..., 1, 2] = -lifted[..., 2, 1]
    rotation = chest @ yaw_rotation(yaw) @ lifted
    reach = mirrored(SHOULDER_IN_CHEST - STERNUM_IN_CHEST)
    return root, root + turned(rotation, reach), rotation


_UP = np.array([0.0, 0.0, 1.0])
"""(3,) up in the world."""
