"""The code on the 360° camera: where it sits on it, and where the camera is once it was moved."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.pose import Pose
from tracking.headset.origin import Origin

KNOWN_M, KNOWN_RAD = 0.006, math.radians(1.0)
"""Standard deviations of the code's pose from which its place on the camera is taken."""

LIMIT_M, LIMIT_RAD = 0.03, math.radians(3.0)
"""Standard deviations of the code's pose within which a camera is looked for where the code says:
what the room's splats refine."""


@dataclass(frozen=True, slots=True, eq=False)
class RigCode:
    """Place of the code on the camera; begin with `RigCode()`.

    Attributes:
        rig_from_code: None before the camera and the code were both known.
        moves: how often the code was elsewhere when the camera was last put there.
    """

    rig_from_code: Pose | None = None
    moves: int = 0


def rig_code_after(
    known: RigCode, origin: Origin, *, world_from_rig: Pose | None
) -> tuple[RigCode, Pose | None]:
    """Return what is known of the code, and the camera's new pose where it was moved.

    Args:
        known: so far.
        origin: with the code's pose in the room.
        world_from_rig: the camera's pose as its own pictures give it; None before it is known.
    """
    belief, moves = origin.carried.belief, origin.carried.restarts
    if belief is None:
        return known, None
    if known.rig_from_code is None:
        is_known = belief.sigma_shift_m <= KNOWN_M and belief.sigma_turn_rad <= KNOWN_RAD
        if world_from_rig is None or not is_known:
            return known, None
        return RigCode(world_from_rig.inverse() @ belief.a_from_b, moves), None
    if moves == known.moves:
        return known, None
    if belief.sigma_shift_m > LIMIT_M or belief.sigma_turn_rad > LIMIT_RAD:
        return known, None  # it was seen too little to say where
    placed = belief.a_from_b @ known.rig_from_code.inverse()
    return RigCode(known.rig_from_code, moves), placed


def is_apart(world_from_rig: Pose, world_from_before: Pose | None) -> bool:
    """Return whether two poses of a camera are two places, rather than one and its error."""
    if world_from_before is None:
        return True
    return (
        float(np.linalg.norm(world_from_rig.translation - world_from_before.translation)) > LIMIT_M
    )
