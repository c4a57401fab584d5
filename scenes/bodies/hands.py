"""Hands: joints of a tracked one to angles of a person's fingers, and those to bones.

A palm's axes: x to the fingers, z out of the back of the hand, y = z × x. Arrays have a row a
finger from the thumb, and of each (spread, flexion of three joints) in radians.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from scenes.bodies.skeleton import FINGER_FLEXION, FINGER_SPREAD, SIDES, rest_arm
from scenes.bodies.vectors import Array, across, cross, dot, frame, packed, unit

FINGERS = 5
"""Of a hand, from the thumb."""

JOINTS = 25
"""Joints of a tracked hand as WebXR names them: wrist, four of the thumb, five of each finger."""

KNUCKLES = np.array(
    [
        [0.022, 0.022, -0.012],
        [0.088, 0.026, 0.000],
        [0.091, 0.004, 0.003],
        [0.085, -0.017, 0.001],
        [0.076, -0.036, -0.004],
    ]
)
"""(5, 3) where fingers begin in the palm of a right hand of 185 mm, metres."""

PHALANGES_M = np.array(
    [
        [0.044, 0.033, 0.026],
        [0.042, 0.025, 0.021],
        [0.046, 0.029, 0.022],
        [0.043, 0.027, 0.022],
        [0.034, 0.020, 0.019],
    ]
)
"""(5, 3) lengths of the fingers' bones, metres."""

FAN_RAD = np.radians([0.0, 6.0, 0.0, -6.0, -13.0])
"""(5,) how fingers stand apart when none is spread; the thumb has axes of its own."""

RELAXED = np.radians(
    [[0, 8, 18, 12], [0, 18, 26, 14], [0, 22, 30, 16], [0, 26, 34, 18], [0, 28, 36, 20]]
)
"""(5, 4) angles of a hand that does nothing."""

POINTING = np.radians(
    [[0, 22, 42, 30], [0, 0, 6, 4], [0, 78, 88, 50], [0, 80, 92, 52], [0, 82, 92, 52]]
)
"""(5, 4) angles of a hand that points with its index finger."""

REST = np.zeros((FINGERS, 4))
"""(5, 4) angles of the hand at rest: flat."""

_FIRST = np.array([2, 6, 11, 16, 21])
"""Joint of a tracked hand at which each drawn finger begins: metacarpal of the thumb, else
knuckle."""


def _bases() -> Array:
    """Return (5, 3, 3): axes of each finger in a right palm, ahead and back of the hand."""
    along = np.stack([np.cos(FAN_RAD), np.sin(FAN_RAD), np.zeros(FINGERS)], axis=1)
    dorsal = np.tile(np.array([0.0, 0.0, 1.0]), (FINGERS, 1))
    along[0] = unit(np.array([0.72, 0.62, -0.32]))
    dorsal[0] = across(np.array([-0.30, 0.62, 0.72]), along[0])
    return packed(along, cross(dorsal, along), dorsal)


_BASES = _bases()
"""(5, 3, 3) those axes, made once."""


def finger_angles(joints: Array) -> tuple[Array, Array]:
    """Return the palm's rotation (..., 3, 3) and the fingers' angles (..., 5, 4) of tracked hands.

    Args:
        joints: (..., 2, 25, 3) in world metres, left and right.
    """
    wrist, mirror = joints[..., 0, :], -SIDES
    ahead = unit(joints[..., 11, :] - wrist)
    width = joints[..., 6, :] - joints[..., 21, :]
    # From the little finger to the index: +y in a right palm, -y in a left one.
    palm = frame(ahead, width * mirror[:, None])
    ends = joints[..., _FIRST[:, None] + np.arange(4) - (np.arange(FINGERS) == 0)[:, None], :]
    bones = unit(np.diff(ends, axis=-2))
    local = np.einsum("...ji,...fsj->...fsi", palm, bones)
    local[..., 1] *= mirror[:, None, None]
    local = np.einsum("fji,...fsj->...fsi", _BASES, local)
    spread = FINGER_SPREAD.clip(np.arcsin(np.clip(local[..., 0, 1], -1.0, 1.0)))
    first = np.arctan2(-local[..., 0, 2], local[..., 0, 0])
    hinge = across(np.array([0.0, 1.0, 0.0]), local[..., 0, :])
    angles = [spread, FINGER_FLEXION[0].clip(first)]
    for k in (1, 2):
        a, b = local[..., k - 1, :], local[..., k, :]
        bend = np.arctan2(dot(cross(a, b), hinge), dot(a, b))
        angles.append(FINGER_FLEXION[k].clip(bend))
    return palm, np.stack(angles, axis=-1)


def fingers(angles: Array) -> tuple[Array, Array]:
    """Return where fingers' bones begin (..., 2, 5, 4, 3) in the palm, metres, and their rotations.

    The fourth is a finger's tip. Rotations (..., 2, 5, 3, 3, 3) turn the flat hand's bones in the
    palm's axes.

    Args:
        angles: (..., 2, 5, 4) of left and right hands.
    """
    along, dorsal = _directions(angles)
    steps = along * PHALANGES_M[..., None]
    start = np.broadcast_to(KNUCKLES[:, None, :] * _mirror(), (*steps.shape[:-2], 1, 3))
    places = np.cumsum(np.concatenate([start, steps], axis=-2), axis=-2)
    turn = frame(along, dorsal) @ _rest_axes()
    return places, turn


def _directions(angles: Array) -> tuple[Array, Array]:
    """Return (..., 2, 5, 3, 3) each: where bones of fingers point in the palm, and their backs."""
    spread = angles[..., 0]
    bend = np.cumsum(angles[..., 1:], axis=-1)
    c, s = np.cos(spread)[..., None], np.sin(spread)[..., None]
    zero = np.zeros_like(bend)
    along = packed(c * np.cos(bend), s + zero, -c * np.sin(bend))
    dorsal = packed(np.sin(bend), zero, np.cos(bend))
    found = (np.einsum("fij,...fsj->...fsi", _BASES, each) * _mirror() for each in (along, dorsal))
    first, second = found
    return first, second


@cache
def _rest_axes() -> Array:
    """Return (2, 5, 3, 3, 3): axes of the flat hand's bones from the palm's."""
    return np.swapaxes(frame(*_directions(np.broadcast_to(REST, (2, FINGERS, 4)))), -1, -2)


@cache
def _mirror() -> Array:
    """Return (2, 1, 1, 3): factors that make a left palm of a right one."""
    return np.array([[[[1.0, -1.0, 1.0]]], [[[1.0, 1.0, 1.0]]]])


@cache
def rest_palm() -> Array:
    """Return (2, 3, 3): person from the palm's axes of hands at rest."""
    along, _, dorsal = rest_arm()
    return packed(along, cross(dorsal, along), dorsal)
