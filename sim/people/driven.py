"""A person driven from outside: head and hands as a headset measures them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.messages import PoseSample
from scenes.pose import Pose, wrap_angle
from sim.navigation.planar import direction
from sim.people.posture import (
    FULL_STRIDE_M,
    SIDES,
    WALKING_SPEED_M_S,
    Posture,
    bend_to_reach,
    resting_hand,
)
from sim.physics.any_room import Physics
from sim.physics.moving.people import HAND_RADIUS_M, HANDS, HandTarget, PersonTarget

HEAD = "head"
BODY_IDS = (HEAD, *HANDS)
"""Name of the stream of one person's samples."""
GRASP_M = 0.15
"""Distance between the middle of a hand and an object within which the hand takes hold of it."""
HEAD_BEFORE_FEET_M = 0.08
"""How far before the ankles somebody upright has the head."""
STANDING_HEAD_M = 1.62
"""Height of the middle of the head of the figure that is drawn, upright."""
LOWEST_HEAD_M = 1.0
"""Height of the head down to which the figure crouches."""


@dataclass(frozen=True, slots=True)
class GripSample:
    """Whether a hand ("left" or "right") is closed at `t_ns`."""

    hand: str
    t_ns: int
    is_closed: bool


class DrivenPerson:
    """Somebody whose head and hands are measured elsewhere.

    Late samples never undo newer ones, and where none come the last pose is held.

    Args:
        person_id: unique; names the person's bodies in the physics.
        start: (x, y) on the floor, until the head has been seen.
        yaw: where the person faces until then, radians from world x.
    """

    def __init__(self, person_id: str, *, start: tuple[float, float], yaw: float) -> None:
        self.person_id = person_id
        self._position = np.array(start, dtype=np.float64)
        self._yaw = yaw
        self._head_m = STANDING_HEAD_M
        self._newest_ns: dict[str, int] = {}
        self._hands: dict[str, NDArray[np.float64]] = {}
        self._yaws: dict[str, float] = {}
        self._closed: dict[str, int] = {}
        self._holds: dict[str, str | None] = dict.fromkeys(HANDS)
        self._leaves: dict[str, str | None] = dict.fromkeys(HANDS)
        self._is_closed: dict[str, bool] = dict.fromkeys(HANDS, False)
        self._stride_m = self._phase = 0.0
        self._walked_from = self._position.copy()

    def see(self, sample: PoseSample) -> bool:
        """Take a sample; False if it is older than what is known.

        Raises:
            ValueError: its body is neither the head nor a hand, or it is not finite.
        """
        if sample.body_id not in BODY_IDS:
            raise ValueError(
                f"{sample.stream_id}: body {sample.body_id!r}, wanted {', '.join(BODY_IDS)}"
            )
        if not np.isfinite(sample.world_from_body.matrix()).all():
            raise ValueError(f"{sample.stream_id}: {sample.body_id} {sample.seq} is not finite")
        if sample.t_ns <= self._newest_ns.get(sample.body_id, -1):
            return False
        self._newest_ns[sample.body_id] = sample.t_ns
        if sample.body_id == HEAD:
            self._see_head(sample.world_from_body)
        else:
            turn = sample.world_from_body.yaw() - self._yaws.get(sample.body_id, 0.0)
            # Past half a turn the spring that turns the hand goes on, not all the way back.
            self._yaws[sample.body_id] = self._yaws.get(sample.body_id, 0.0) + wrap_angle(turn)
            self._hands[sample.body_id] = sample.world_from_body.translation
        return True

    def grip(self, sample: GripSample) -> bool:
        """Close or open a hand; False if it is older than what is known.

        Raises:
            ValueError: there is no such hand.
        """
        if sample.hand not in HANDS:
            raise ValueError(f"hand {sample.hand!r}, wanted {' or '.join(HANDS)}")
        if sample.t_ns <= self._closed.get(sample.hand, -1):
            return False
        self._closed[sample.hand] = sample.t_ns
        self._is_closed[sample.hand] = sample.is_closed
        return True

    def tick(self, physics: Physics, sizes_m: Mapping[str, tuple[float, float, float]]) -> None:
        """Let closed hands take what is within reach, and open ones let go.

        Args:
            physics: where the hands and objects are.
            sizes_m: box (x, y, z) of each object that can be held, by id; its base is its origin.
        """
        for hand in HANDS:
            gaps = _gaps(physics.hand_position(self.person_id, hand), physics, sizes_m)
            if not self._is_closed[hand]:
                # A hand that was solid at once would kick away what it lets go.
                self._leaves[hand] = self._holds[hand] or self._leaves[hand]
                self._holds[hand] = None
            elif self._holds[hand] is None:
                self._holds[hand] = next(
                    (n for n in sorted(gaps, key=gaps.__getitem__) if gaps[n] < GRASP_M), None
                )
            left = self._leaves[hand]
            if left is not None and gaps.get(left, math.inf) > HAND_RADIUS_M:
                self._leaves[hand] = None
        walked = float(np.linalg.norm(self._position - self._walked_from))
        self._walked_from = self._position.copy()
        wanted = FULL_STRIDE_M * min(1.0, walked / 0.01 / WALKING_SPEED_M_S)
        self._stride_m += 0.06 * (wanted - self._stride_m)
        self._phase = (self._phase + walked / max(self._stride_m, 0.35)) % 1.0

    def target(self) -> PersonTarget:
        """Targets of the person's feet and hands."""
        left, right = (
            self._hand_target(hand, side) for hand, side in zip(HANDS, SIDES, strict=True)
        )
        return PersonTarget(self._position.copy(), left, right)

    def posture(self, physics: Physics) -> Posture:
        """The shape to draw: hands where the physics has them."""
        left, right = (physics.hand_position(self.person_id, hand) for hand in HANDS)
        return self._posture(left, right)

    def _posture(self, left: NDArray[np.float64], right: NDArray[np.float64]) -> Posture:
        lean, crouch = 0.03, 0.0
        if self._hands:
            lean, crouch = bend_to_reach(self._position, self._yaw, left, right)
        crouch = max(crouch, STANDING_HEAD_M - max(self._head_m, LOWEST_HEAD_M))
        return Posture(
            self._position.copy(),
            self._yaw,
            self._phase,
            self._stride_m,
            lean,
            crouch,
            left,
            right,
        )

    def _see_head(self, world_from_head: Pose) -> None:
        """Feet below the head, body where the head looks."""
        ahead = world_from_head.rotation[:, 2]
        if math.hypot(ahead[0], ahead[1]) > 0.2:
            self._yaw = math.atan2(ahead[1], ahead[0])
        place = world_from_head.translation
        self._position = place[:2] - HEAD_BEFORE_FEET_M * direction(self._yaw)
        self._head_m = float(place[2])

    def _hand_target(self, hand: str, side: float) -> HandTarget:
        place = self._hands.get(hand)
        if place is None:
            nowhere = np.zeros(3)
            shape = Posture(self._position, self._yaw, 0.0, 0.0, 0.03, 0.0, nowhere, nowhere)
            return HandTarget(resting_hand(shape, side))
        is_solid = self._leaves[hand] is None
        yaw, holds = self._yaws[hand], self._holds[hand]
        return HandTarget(place.copy(), yaw, solid=is_solid, holds=holds)


def _gaps(
    place: NDArray[np.float64],
    physics: Physics,
    sizes_m: Mapping[str, tuple[float, float, float]],
) -> dict[str, float]:
    """Distance from a place (3,) to the box of each object, by id, metres."""
    gaps: dict[str, float] = {}
    for object_id, size in sizes_m.items():
        x, y, z = physics.object_pose(object_id).inverse() @ place
        beyond = np.maximum(
            np.abs([x, y, z - 0.5 * size[2]]) - 0.5 * np.asarray(size, dtype=np.float64), 0.0
        )
        gaps[object_id] = float(np.linalg.norm(beyond))
    return gaps
