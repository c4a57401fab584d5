"""Moves of one person with a headset, by seed: the same body at the same time, every time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from devices.hub.protocol.wire import JOINTS, Body, Controller, Hand, encode_body
from scenes.frames import OPENGL_FROM_OPENCV, WORLD_FROM_GLTF, look_at
from scenes.pose import Pose

Array = NDArray[np.float64]

STROLL_M, STROLL_S = 0.9, 17.0
"""Radius of the way that a head takes, and the time for a round: a slow walk of 0.3 m/s."""

HEIGHT_M = 1.62
"""Height of the eyes: of the figure that rehearsals draw."""

SWAY_M, SWAY_S = 0.02, 1.1
"""Up and down of a head in walking, and the time of a step."""

REACH_M = np.array([0.22, 0.38, 0.42])
"""Right hand from the head, to the right of it, below it, ahead of it; a person's elbows bent."""

WAVE_M, WAVE_S = 0.12, 2.3
"""Moves of a hand about that place, and their time."""

CURL_RAD, CURL_S = math.radians(50.0), 3.1
"""Largest bend of each joint of a finger, and the time in which a hand closes and opens."""

POINTING_SHARE, POINTING_S = 0.6, 5.0
"""Part of the time in which somebody points, and how long they do and do not."""

RAY_M = 2.5
"""Length of a ray: to the other side of a room."""

CONTROLLER_EVERY = 4
"""Every fourth seed holds controllers in place of bare hands, chosen: both are tried."""

FINGER_BASES_M = (
    (-0.030, 0.012),
    (-0.024, 0.032),
    (-0.004, 0.034),
    (0.014, 0.032),
    (0.030, 0.028),
)
"""Begin of thumb, index, middle, ring and little finger: across the hand and ahead of the wrist."""

SEGMENTS_M = (
    (0.034, 0.032, 0.024),
    (0.058, 0.040, 0.024, 0.020),
    (0.056, 0.044, 0.027, 0.021),
    (0.052, 0.040, 0.026, 0.021),
    (0.048, 0.031, 0.020, 0.019),
)
"""Lengths from joint to joint of each finger, metres: a medium hand, as WebXR counts its joints."""

THUMB_RAD = math.radians(35.0)
"""Angle of the thumb to the other fingers, seen from above."""

WRIST_RADIUS_M, TIP_RADIUS_M = 0.020, 0.006
"""Radius of the skin at the wrist and at a fingertip."""

FILM_S = 5.0
"""Length of the moves that are made beforehand; played forward and backward."""


@dataclass(frozen=True, slots=True)
class Moves:
    """A person who strolls about, looks around, moves both hands and points now and then.

    Attributes:
        seed: of everything: two people with different seeds are elsewhere and move otherwise.
        centre: (x, y) of the way on the floor, world metres.
    """

    seed: int
    centre: tuple[float, float] = (0.0, 0.0)

    @property
    def has_controllers(self) -> bool:
        """Whether the person holds controllers in place of bare hands."""
        return self.seed % CONTROLLER_EVERY == CONTROLLER_EVERY - 1

    def body(self, t_s: float, *, seq: int, t_us: int) -> Body:
        """Return the body at a moment.

        Args:
            t_s: time since the person began to move.
            seq: the body's number.
            t_us: device time that it is stamped with.
        """
        head = self.world_from_head(t_s)
        wrists = [self._world_from_wrist(head, t_s, side=side) for side in (-1.0, 1.0)]
        room_from_head = _in_gltf(head)
        ray = None
        if (t_s + self._phases()[3]) % (POINTING_S / POINTING_SHARE) < POINTING_S:
            tip = self._hand(wrists[1], t_s, side=1.0)[INDEX_TIP]
            ray = _points_in_gltf(np.stack([tip, tip + RAY_M * wrists[1].rotation[:, 2]]))
        if self.has_controllers:
            left, right = (Controller(_in_gltf(wrist), _in_gltf(wrist)) for wrist in wrists)
            return Body(seq, t_us, room_from_head, controllers=(left, right), ray=ray)
        hands = [
            Hand(_points_in_gltf(self._hand(wrist, t_s, side=side)), _radii())
            for wrist, side in zip(wrists, (-1.0, 1.0), strict=True)
        ]
        return Body(seq, t_us, room_from_head, hands=(hands[0], hands[1]), ray=ray)

    def world_from_head(self, t_s: float) -> Pose:
        """Return the head: OpenCV axes, in the world."""
        around, sway, nod, _ = self._phases()
        angle = 2.0 * math.pi * t_s / STROLL_S + around
        eye = np.array(
            [
                self.centre[0] + STROLL_M * math.cos(angle),
                self.centre[1] + 0.7 * STROLL_M * math.sin(angle),
                HEIGHT_M + SWAY_M * math.sin(2.0 * math.pi * t_s / SWAY_S + sway),
            ]
        )
        look = angle + 0.5 * math.pi + 0.6 * math.sin(0.7 * t_s + nod)
        ahead = np.array([math.cos(look), math.sin(look), 0.25 * math.sin(0.9 * t_s + nod) - 0.1])
        return look_at(eye, eye + ahead)

    def pen(self, t_s: float) -> Array:
        """Return (3,) the tip of the right index finger, in the room's glTF axes."""
        wrist = self._world_from_wrist(self.world_from_head(t_s), t_s, side=1.0)
        return _points_in_gltf(self._hand(wrist, t_s, side=1.0)[INDEX_TIP])

    def _phases(self) -> Array:
        return _phases(self.seed)

    def _world_from_wrist(self, head: Pose, t_s: float, *, side: float) -> Pose:
        """Return a wrist: axes as the head's, level; z to where the fingers show."""
        level = look_at(head.translation, head.translation + _level(head.rotation[:, 2]))
        turn = 2.0 * math.pi * t_s / WAVE_S + side * float(self._phases()[1])
        wave = WAVE_M * np.array([math.sin(turn), 0.6 * math.cos(turn), 0.5 * math.sin(2.0 * turn)])
        return Pose(level.rotation, level @ (REACH_M * [side, 1.0, 1.0] + wave))

    def _hand(self, world_from_wrist: Pose, t_s: float, *, side: float) -> Array:
        """Return (25, 3) joints in the world."""
        bend = 0.5 * CURL_RAD * (1.0 - math.cos(2.0 * math.pi * t_s / CURL_S + side))
        return world_from_wrist @ _hand_in_wrist(side, bend)


INDEX_TIP = 9
"""Place of the index finger's tip among a hand's joints: wrist, four of the thumb, five."""


@cache
def _phases(seed: int) -> Array:
    return np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, 4)


@cache
def _radii() -> Array:
    fingers = [np.linspace(0.010, TIP_RADIUS_M, len(lengths) + 1) for lengths in SEGMENTS_M]
    return np.concatenate([[WRIST_RADIUS_M], *fingers])


def _hand_in_wrist(side: float, bend: float) -> Array:
    """Return (25, 3) joints: x right, y down, z along the fingers; thumbs are inside."""
    fingers, bends, across, along, lengths = _bones()
    down = bend * bends
    steps = np.stack([-side * across, np.sin(down), along * np.cos(down)], axis=1)
    steps *= (lengths / np.linalg.norm(steps, axis=1))[:, None]
    joints = np.zeros((JOINTS, 3))
    for first, last, (base_x, base_z) in fingers:
        joints[first] = side * base_x, 0.004, base_z
        joints[first + 1 : last] = joints[first] + np.cumsum(steps[first : last - 1], axis=0)
    return joints


@cache
def _bones() -> tuple[list[tuple[int, int, tuple[float, float]]], Array, Array, Array, Array]:
    """Return each finger's joints and begin, and by joint what follows it.

    Of the part from a joint to the next: its bends, how much of it goes across and along the hand,
    and its length; 1 for joints that nothing follows.
    """
    fingers: list[tuple[int, int, tuple[float, float]]] = []
    bends, lengths = np.zeros(JOINTS), np.ones(JOINTS)
    across, along = np.zeros(JOINTS), np.ones(JOINTS)
    at = 1
    for finger, (base, parts) in enumerate(zip(FINGER_BASES_M, SEGMENTS_M, strict=True)):
        here = slice(at, at + len(parts))
        bends[here] = np.arange(len(parts)) * (0.4 if finger == 0 else 1.0)
        lengths[here] = parts
        apart = THUMB_RAD if finger == 0 else 0.0
        across[here], along[here] = math.sin(apart), math.cos(apart)
        fingers.append((at, at + len(parts) + 1, base))
        at += len(parts) + 1
    return fingers, bends, across, along, lengths


def _level(direction: Array) -> Array:
    flat = np.array([direction[0], direction[1], 0.0])
    return flat / max(float(np.linalg.norm(flat)), 1e-6)


def _in_gltf(world_from_item: Pose) -> Pose:
    """Return a pose of OpenCV axes in the world as one of glTF axes in the room."""
    return WORLD_FROM_GLTF.inverse() @ world_from_item @ OPENGL_FROM_OPENCV


def _points_in_gltf(in_world: Array) -> Array:
    return WORLD_FROM_GLTF.inverse() @ in_world


def filmed(moves: Moves, rate_hz: float) -> list[bytearray]:
    """Return bodies in bytes for the first seconds of somebody's moves."""
    count = max(round(FILM_S * rate_hz), 2)
    return [
        bytearray(encode_body(moves.body(number / rate_hz, seq=number, t_us=0)))
        for number in range(count)
    ]


def place_in_film(seq: int, count: int) -> int:
    """Return the place of a body in a film that is played forward and backward."""
    at = seq % (2 * count - 2)
    return min(at, 2 * count - 2 - at)
