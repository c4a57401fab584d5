"""Goals of bodies: heads and hands as headsets, controllers or a simulation give them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenes.bodies.hands import FINGERS, JOINTS, POINTING, finger_angles
from scenes.bodies.vectors import Array, length, unit
from scenes.frames import CAMERA_FROM_AHEAD
from scenes.state import Avatar

GRIP_M = 0.085
"""From the wrist to the middle of the palm, metres: where a hand is held that is one point."""

POINTING_REACH_M = 0.545
"""From the shoulder to the wrist of somebody who points, metres: an arm that is nearly straight."""


@dataclass(frozen=True, slots=True, eq=False)
class Goals:
    """Places that N people's heads and hands should have; NaN where nobody knows.

    Attributes:
        eyes: (N, 3) points between the eyes, world metres, the floor at z = 0.
        heads: (N, 3, 3) world from a head's axes: x ahead, y left, z up.
        wrists: (N, 2, 3) left and right, world metres.
        grips_m: (N, 2) how far beyond the wrist that point is: 0 a wrist, `GRIP_M` a palm.
        palms: (N, 2, 3, 3) world from a palm's axes (`scenes.bodies.hands`).
        fingers: (N, 2, 5, 4) angles of fingers.
        aims: (N, 3) what is pointed at without a tracked hand, world metres.
    """

    eyes: Array
    heads: Array
    wrists: Array
    grips_m: Array
    palms: Array
    fingers: Array
    aims: Array


def unknown(count: int) -> Goals:
    """Return goals of people who stand at the origin and of whose hands nothing is known."""
    nan = np.nan
    return Goals(
        eyes=np.tile(np.array([0.0, 0.0, 1.6]), (count, 1)),
        heads=np.tile(np.eye(3), (count, 1, 1)),
        wrists=np.full((count, 2, 3), nan),
        grips_m=np.zeros((count, 2)),
        palms=np.full((count, 2, 3, 3), nan),
        fingers=np.full((count, 2, FINGERS, 4), nan),
        aims=np.full((count, 3), nan),
    )


def goals_of(avatars: Sequence[Avatar]) -> Goals:
    """Return the goals of people of a state.

    A hand of 25 joints is a tracked one; of others the mean of the joints is taken for the palm. Of
    two hands the first is the left one, a single one is of the side it is on. Who has a pointing
    ray and no hand points with the right arm.
    """
    found = unknown(len(avatars))
    for row, avatar in enumerate(avatars):
        head = avatar.world_from_head
        found.eyes[row] = head.translation
        found.heads[row] = head.rotation @ CAMERA_FROM_AHEAD.rotation
        known = [np.atleast_2d(hand) for hand in avatar.hands[:2] if np.size(hand)]
        for k, hand in enumerate(known):
            side = k if len(known) == 2 else _side_of(hand, found.heads[row], eyes=found.eyes[row])
            _add_hand(found, row, side=side, hand=hand)
        if avatar.ray is not None:
            if not known:
                found.aims[row] = avatar.ray[1]
            elif all(len(hand) != JOINTS for hand in known):
                nearest = np.argmin(_distances(found.wrists[row], avatar.ray[0]))
                found.fingers[row, nearest] = POINTING
    return found


def _distances(wrists: Array, point: Array) -> Array:
    return np.where(np.isnan(wrists[:, 0]), np.inf, length(wrists - point))


def _side_of(hand: Array, head: Array, *, eyes: Array) -> int:
    return int(((hand.mean(axis=0) - eyes) @ head)[1] < 0.0)


def _add_hand(goals: Goals, row: int, *, side: int, hand: Array) -> None:
    if len(hand) != JOINTS:
        goals.wrists[row, side] = hand.mean(axis=0)
        goals.grips_m[row, side] = GRIP_M
        return
    both = np.stack([hand, hand])
    palm, angles = finger_angles(both)
    goals.wrists[row, side] = hand[0]
    if np.isfinite(palm[side]).all() and np.isfinite(angles[side]).all():
        goals.palms[row, side] = palm[side]
        goals.fingers[row, side] = angles[side]


def pointing_wrists(aims: Array, shoulders: Array) -> Array:
    """Return (N, 3) where wrists of right arms are that point at something.

    Args:
        aims: (N, 3) what is pointed at.
        shoulders: (N, 3) right shoulders, in the same unit.
    """
    return shoulders + POINTING_REACH_M * unit(aims - shoulders)
