"""A person who acts: body and hands as they change, and what the person can see."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.state import Annotation
from sim.navigation.floor import FloorMap, FreeFloor
from sim.navigation.planar import direction, towards
from sim.people.posture import (
    FULL_STRIDE_M,
    SEAT_BACK_M,
    SIDES,
    WALKING_SPEED_M_S,
    Posture,
    bend_to_reach,
    resting_hand,
)
from sim.physics.any_room import Physics
from sim.physics.moving.people import HANDS, HandTarget, PersonTarget

Vector = NDArray[np.float64]
Script = Iterator[str | None]
"""Yields once a tick; a text is an event worth recording."""

TICK_NS = 10_000_000
TICK_S = TICK_NS * 1e-9
HAND_SPEED_M_S = 1.5
CAMERA_MARGIN_M = 0.25
STUCK_M = 0.10
COMFORTABLE_REACH_M = 0.8
ON_FLOOR_M = 0.3
"""Height of an object's base below which people walk around it."""


@dataclass(slots=True, eq=False)
class Hand:
    """One hand as its person wants it; `wanted` is None while it hangs."""

    position: Vector
    wanted: Vector | None = None
    yaw: float = 0.0
    solid: bool = False
    holds: str | None = None


@dataclass(slots=True, eq=False)
class Body:
    """A person's changing state; `seated` is 0 on the feet and 1 on a seat."""

    position: Vector
    yaw: float
    speed_m_s: float = 0.0
    stride_phase: float = 0.0
    stride_m: float = 0.0
    lean_rad: float = 0.0
    crouch_m: float = 0.0
    seated: float = 0.0
    seat_height_m: float = 0.45
    hands: list[Hand] = field(default_factory=list[Hand])


class Person:
    """Somebody in a room.

    Args:
        person_id: unique; names the person's bodies in the physics.
        room: for the objects' shapes.
        start: (x, y) on the floor.
        yaw: where the person faces, radians from world x.
        camera_xy: where the camera's stand is, to walk around it and to hide objects from it.
    """

    def __init__(
        self,
        person_id: str,
        room: PhysicalRoom,
        *,
        start: tuple[float, float],
        yaw: float,
        camera_xy: Vector,
    ) -> None:
        self.person_id = person_id
        self.room = room
        self.camera_xy = camera_xy
        self.floor_map = FloorMap(room)
        self.others: Mapping[str, Person] = {}
        self.offers: str | None = None
        self.ray: NDArray[np.float64] | None = None
        self.drawings: dict[str, Annotation] = {}
        self.body = Body(np.array(start, dtype=np.float64), yaw)
        self.body.hands = [Hand(resting_hand(self.posture_at_rest(), side)) for side in SIDES]
        self._physics: Physics | None = None

    @property
    def physics(self) -> Physics:
        """The room the person is in; there is one as soon as time passes."""
        assert self._physics is not None
        return self._physics

    @physics.setter
    def physics(self, physics: Physics) -> None:
        self._physics = physics

    def posture_at_rest(self) -> Posture:
        """The shape with hanging arms, wherever the person is now."""
        nowhere = np.zeros(3)
        return self._posture(nowhere, nowhere)

    def posture(self, physics: Physics) -> Posture:
        """The shape to draw: hands where the physics has them."""
        left, right = (physics.hand_position(self.person_id, hand) for hand in HANDS)
        return self._posture(left, right)

    def _posture(self, left: Vector, right: Vector) -> Posture:
        b = self.body
        return Posture(
            b.position.copy(),
            b.yaw,
            b.stride_phase,
            b.stride_m,
            b.lean_rad,
            b.crouch_m,
            left,
            right,
            b.seated,
            b.seat_height_m,
        )

    def target(self) -> PersonTarget:
        """Targets of the person's feet and hands."""
        b = self.body
        left, right = (HandTarget(h.position.copy(), h.yaw, h.solid, h.holds) for h in b.hands)
        if b.seated > 0.0:
            hips = b.position - SEAT_BACK_M * b.seated * direction(b.yaw)
            return PersonTarget(hips, left, right, solid=False)
        return PersonTarget(b.position.copy(), left, right)

    def settle(self, walked_m: float) -> None:
        """Legs follow the feet, the back follows the hands, idle hands hang."""
        b = self.body
        speed = walked_m / TICK_S
        stride = min(1.0, speed / WALKING_SPEED_M_S)
        wanted_stride = FULL_STRIDE_M * (0.35 + 0.65 * stride) if speed > 0.02 else 0.0
        b.stride_m += (wanted_stride - b.stride_m) * min(1.0, 6.0 * TICK_S)
        if speed > 0.02:
            b.stride_phase = (b.stride_phase + walked_m / max(b.stride_m, 0.35)) % 1.0
        rest = self.posture_at_rest()
        for hand, side in zip(b.hands, SIDES, strict=True):
            goal = resting_hand(rest, side) if hand.wanted is None else hand.wanted
            hand.position = towards(hand.position, goal, HAND_SPEED_M_S * TICK_S + walked_m)
        if all(hand.wanted is None for hand in b.hands) or b.seated > 0.0:
            lean, crouch = 0.03 + 0.06 * stride, 0.0
        else:
            lean, crouch = bend_to_reach(
                b.position, b.yaw, b.hands[0].position, b.hands[1].position
            )
        b.lean_rad += (lean - b.lean_rad) * min(1.0, 5.0 * TICK_S)
        b.crouch_m += (crouch - b.crouch_m) * min(1.0, 5.0 * TICK_S)

    def held_hand(self, object_id: str) -> Hand | None:
        """The hand that holds an object, or None."""
        return next((hand for hand in self.body.hands if hand.holds == object_id), None)

    def let_go(self) -> str | None:
        """Stop with everything at once, hands hanging; returns the id of what was held, or None."""
        held = next((hand.holds for hand in self.body.hands if hand.holds is not None), None)
        for hand in self.body.hands:
            hand.wanted, hand.yaw, hand.solid, hand.holds = None, 0.0, False, None
        self.body.speed_m_s, self.offers, self.ray = 0.0, None, None
        return held

    def is_stuck(self) -> bool:
        """Whether a hand has been held back by something that does not give way."""
        return any(
            float(np.linalg.norm(self.physics.hand_position(self.person_id, name) - hand.position))
            > STUCK_M
            for name, hand in zip(HANDS, self.body.hands, strict=True)
        )

    def floor(self, *, ignore: str | None = None, apart_m: float = 0.0) -> FreeFloor:
        """Return the floor on which the person may walk at this moment.

        Args:
            ignore: an object of which only the core is in the way.
            apart_m: distance kept from objects beyond the usual one.
        """
        obstacles = [(self.camera_xy, CAMERA_MARGIN_M)]
        for item in self.room.objects:
            position = self.physics.object_pose(item.object_id).translation
            if position[2] < ON_FLOOR_M and item.object_id != ignore:
                obstacles.append((position[:2], 0.5 * max(item.box_m[:2]) + apart_m))
        if ignore is not None:
            item = self.room.object_by_id(ignore)
            radius = 0.5 * min(item.box_m[:2])
            obstacles.append((self.physics.object_pose(ignore).translation[:2], radius))
        return self.floor_map.around(obstacles)

    def beside(self, point: Vector, *, min_m: float = 0.0, apart_m: float = 0.0) -> Vector:
        """Free floor near `point`, and near where the person already is if that is in reach.

        Args:
            point: (x, y).
            min_m: distance to keep from it, if it can be kept.
            apart_m: distance kept from objects beyond the usual one.
        """
        floor = self.floor(apart_m=apart_m)
        near = floor.reachable(self.body.position) if floor.free.any() else floor
        centres = near.centres()[near.free.ravel()]
        if not len(centres):
            return self.body.position.copy()
        away = np.linalg.norm(centres - point, axis=1)
        way = np.linalg.norm(centres - self.body.position, axis=1)
        cost = away + 0.5 * way + 10.0 * np.maximum(away - COMFORTABLE_REACH_M, 0.0)
        if min_m > 0.0:
            cost = cost + 10.0 * np.maximum(min_m - away, 0.0)
        return centres[int(np.argmin(cost))]

    def eye_height_m(self) -> float:
        """Height of the shoulders above the floor, from where an arm points."""
        return 1.37 - 0.5 * self.body.seated


def shoulder(person: Person, side: float) -> Vector:
    """(3,) world place of a shoulder of somebody upright: `side` +1 left, -1 right."""
    b = person.body
    back = SEAT_BACK_M * b.seated
    c, s = math.cos(b.yaw), math.sin(b.yaw)
    x, y = -back, 0.178 * side
    return np.array(
        [b.position[0] + c * x - s * y, b.position[1] + s * x + c * y, person.eye_height_m()]
    )
