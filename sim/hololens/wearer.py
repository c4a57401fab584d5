"""Wearers: where somebody's head and hands are at a moment, in the room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from devices.hololens.values import HandJoints, Joint, Ray
from devices.hub.protocol.wire import Hand
from scenes.frames import WORLD_FROM_GLTF, look_at
from scenes.pose import Pose
from sim.headset.moves import CONTROLLER_EVERY, Moves

Array = NDArray[np.float64]

TARGET_S, TURN_S = 2.5, 0.8
"""How long a wearer looks at one target, and the part of it in which the head turns to it."""

PALM_RADIUS_M = 0.022
"""Radius of the skin around the palm's middle."""

AFTER = {
    Joint.PALM: Joint.MIDDLE_PROXIMAL,
    Joint.WRIST: Joint.MIDDLE_METACARPAL,
    Joint.THUMB_METACARPAL: Joint.THUMB_PROXIMAL,
    Joint.THUMB_PROXIMAL: Joint.THUMB_DISTAL,
    Joint.THUMB_DISTAL: Joint.THUMB_TIP,
}
"""Joints that others point to; along a finger it is the next one."""

TIPS = (Joint.THUMB_TIP, Joint.INDEX_TIP, Joint.MIDDLE_TIP, Joint.RING_TIP, Joint.LITTLE_TIP)
"""Joints that point as the one before them."""


@dataclass(frozen=True, slots=True, eq=False)
class WornBody:
    """Body of a wearer as a headset senses it, in the room, z up.

    Attributes:
        world_from_head: OpenCV axes.
        gaze: None where the eyes are not followed.
        left: None where the hand is not seen.
        right: likewise.
    """

    world_from_head: Pose
    gaze: Ray | None
    left: HandJoints | None
    right: HandJoints | None


class Wearer(Protocol):
    """Somebody with the headset on."""

    def at(self, t_s: float) -> WornBody:
        """Return the body at a moment, seconds since the simulator began."""
        ...


@dataclass(frozen=True, slots=True)
class Stroller:
    """Walks about, looks around or from target to target, and moves both hands.

    Attributes:
        seed: of everything.
        centre: (x, y) of the way on the floor, metres.
        targets: places that are looked at in turn, metres; none: wherever the way leads.
    """

    seed: int = 0
    centre: tuple[float, float] = (0.0, 0.0)
    targets: Sequence[tuple[float, float, float]] = field(default_factory=tuple)

    def at(self, t_s: float) -> WornBody:
        """Return the body at a moment."""
        # Every fourth seed of these moves holds controllers, which nobody does here.
        seed = self.seed // (CONTROLLER_EVERY - 1) * CONTROLLER_EVERY
        moves = Moves(seed + self.seed % (CONTROLLER_EVERY - 1), self.centre)
        body = moves.body(t_s, seq=0, t_us=0)
        head = moves.world_from_head(t_s)
        if self.targets:
            head = look_at(head.translation, self._target(t_s))
        left, right = body.hands
        return WornBody(head, _gaze(head, t_s), _joints(left), _joints(right))

    def _target(self, t_s: float) -> Array:
        """Return the place that is looked at; while the head turns, one between two."""
        number, since_s = divmod(t_s, TARGET_S)
        before, after = (
            np.array(self.targets[(int(number) + k) % len(self.targets)]) for k in (-1, 0)
        )
        share = min(since_s / TURN_S, 1.0)
        return before + (after - before) * share * share * (3.0 - 2.0 * share)


def _gaze(head: Pose, t_s: float) -> Ray:
    """Eyes that wander about where the face looks."""
    aside = np.array([0.12 * math.sin(1.7 * t_s), 0.08 * math.sin(2.3 * t_s), 1.0])
    direction = head.rotation @ aside
    return Ray(head.translation, direction / float(np.linalg.norm(direction)))


def _joints(hand: Hand | None) -> HandJoints | None:
    """26 joints of the 25 that WebXR counts: the palm is between wrist and middle finger."""
    if hand is None:
        return None
    in_world = WORLD_FROM_GLTF @ hand.joints
    # Without the palm, what WebXR calls 0 is 1 here.
    middle = in_world[Joint.MIDDLE_METACARPAL - 1], in_world[Joint.MIDDLE_PROXIMAL - 1]
    positions = np.concatenate([[0.5 * (middle[0] + middle[1])], in_world])
    radii = np.concatenate([[PALM_RADIUS_M], hand.radii_m])
    return HandJoints(positions, _rotations(positions), radii, np.ones(len(positions), np.bool_))


def _rotations(positions: Array) -> Array:
    """Return (26, 3, 3): -z along the finger, y out of the back of the hand, which is up here."""
    ahead = positions[_TO] - positions[_FROM]
    back = -ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    # A finger that points straight down has its back ahead.
    is_level = np.abs(back[:, 2:]) < 0.95
    up = np.where(is_level, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    out: Array = up - np.sum(up * back, axis=1, keepdims=True) * back
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    aside = np.asarray(np.cross(out, back), dtype=np.float64)
    return np.stack([aside, out, back], axis=2)


def _ends() -> tuple[list[int], list[int]]:
    """Return from which joint to which each joint points."""
    begins = [joint - 1 if joint in TIPS else joint for joint in Joint]
    ends = [joint if joint in TIPS else AFTER.get(joint, joint + 1) for joint in Joint]
    return [int(joint) for joint in begins], [int(joint) for joint in ends]


_FROM, _TO = _ends()
