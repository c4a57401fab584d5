"""Scripted people. They decide where their feet and hands go; the physics decides the rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.pose import Pose, wrap_angle
from sim.actions import Action, Carry, Hide, Push, Stand, Turn, Walk
from sim.grip import Grip, side_extent, side_to_push
from sim.paths import FreeFloor, free_floor, walking_path
from sim.planar import bearing, direction, level, towards, turned
from sim.posture import (
    FULL_STRIDE_M,
    SIDES,
    WALKING_SPEED_M_S,
    Posture,
    bend_to_reach,
    resting_hand,
)
from sim.world import HAND_RADIUS_M, HandTarget, PersonTarget, World

Vector = NDArray[np.float64]
Script = Iterator[str | None]
"""Yields once a tick; a text is an event worth recording."""

TICK_NS = 10_000_000
TICK_S = TICK_NS * 1e-9
TURN_RATE_RAD_S = 3.2
HAND_SPEED_M_S = 1.5
ACCELERATION_M_S2 = 2.5
ARRIVED_M = 0.03
REACH_M = 0.42
CAMERA_MARGIN_M = 0.25
STUCK_M = 0.10
PUSH_TIME_LIMIT_S = 12.0
PRESS_M = 0.006
"""Metres below their own height at which pushing hands aim, chosen: pressing down on the near edge
keeps objects upright."""

STEER_RAD_S = 0.6
MAX_LEAD_RAD = 0.15
LIFT_M = 0.14
CARRIED_AT_M = np.array([0.36, -0.08, 1.08])
COMFORTABLE_REACH_M = 0.8
GRASP_HEIGHT_M = 0.02
RELEASE_GAP_M = 0.004


@dataclass(slots=True, eq=False)
class _Hand:
    position: Vector
    wanted: Vector | None = None
    yaw: float = 0.0
    solid: bool = False
    holds: str | None = None


@dataclass(slots=True, eq=False)
class _Body:
    """The person's changing state."""

    position: Vector
    yaw: float
    speed_m_s: float = 0.0
    stride_phase: float = 0.0
    stride_m: float = 0.0
    lean_rad: float = 0.0
    crouch_m: float = 0.0
    hands: list[_Hand] = field(default_factory=list[_Hand])


class Actor:
    """One scripted person.

    Args:
        person_id: unique; names the person's bodies in the world.
        room: for the floor and the objects' shapes.
        start: (x, y) on the floor.
        yaw: where the person faces, radians from world x.
        actions: done one after the other; then the person stands still.
        camera_xy: where the camera's stand is, to walk around it and to hide objects from it.
    """

    def __init__(
        self,
        person_id: str,
        room: PhysicalRoom,
        *,
        start: tuple[float, float],
        yaw: float,
        actions: Sequence[Action],
        camera_xy: Vector,
    ) -> None:
        self.person_id = person_id
        self._room = room
        self._camera_xy = camera_xy
        self._body = _Body(np.array(start, dtype=np.float64), yaw)
        self._body.hands = [_Hand(resting_hand(self.posture_at_rest(), side)) for side in SIDES]
        self._actions = tuple(actions)
        self._begun = 0
        self._script: Script | None = None

    def posture_at_rest(self) -> Posture:
        """The shape with hanging arms, wherever the person is now."""
        b = self._body
        nowhere = np.zeros(3)
        return Posture(
            b.position, b.yaw, b.stride_phase, b.stride_m, b.lean_rad, b.crouch_m, nowhere, nowhere
        )

    def posture(self, world: World) -> Posture:
        """The shape to draw: hands where the physics has them."""
        b = self._body
        return Posture(
            b.position.copy(),
            b.yaw,
            b.stride_phase,
            b.stride_m,
            b.lean_rad,
            b.crouch_m,
            world.hand_position(self.person_id, "left"),
            world.hand_position(self.person_id, "right"),
        )

    def target(self) -> PersonTarget:
        """What the person wants now."""
        left, right = (
            HandTarget(h.position.copy(), h.yaw, h.solid, h.holds) for h in self._body.hands
        )
        return PersonTarget(self._body.position.copy(), left, right)

    def tick(self, world: World) -> str | None:
        """Let 10 ms pass in the person's head; returns what began or ended, in words, or None."""
        if self._script is None:
            self._script = self._run(world)
        walked_from = self._body.position.copy()
        said = next(self._script, None)
        self._settle(float(np.linalg.norm(self._body.position - walked_from)))
        return said

    def go_on_with(self, actions: Sequence[Action]) -> str | None:
        """Do other actions from now on; returns what ends with that, in words, or None.

        If what was begun so far begins the new list, the rest of it follows; otherwise the person
        lets go, stops, and begins the new list here.
        """
        begun, self._actions = self._actions[: self._begun], tuple(actions)
        if self._actions[: len(begun)] == begun:
            return None
        held = [hand.holds for hand in self._body.hands if hand.holds is not None]
        for hand in self._body.hands:
            hand.wanted, hand.yaw, hand.solid, hand.holds = None, 0.0, False, None
        self._body.speed_m_s = 0.0
        self._begun, self._script = 0, None
        return f"stops, lets go of {held[0]}" if held else "stops"

    def _run(self, world: World) -> Script:
        while True:
            if self._begun == len(self._actions):
                yield None
                continue
            action = self._actions[self._begun]
            self._begun += 1
            match action:
                case Walk():
                    yield from self._walk(world, np.array(action.to), action.face_deg)
                case Stand():
                    yield from self._stand(action.seconds)
                case Push():
                    yield from self._push(world, action)
                case Turn():
                    yield from self._turn(world, action)
                case Carry():
                    yield from self._carry(world, action)
                case Hide():
                    yield from self._hide(world, action)

    def _settle(self, walked_m: float) -> None:
        """Legs follow the feet, the back follows the hands, idle hands hang."""
        b = self._body
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
        if all(hand.wanted is None for hand in b.hands):
            lean, crouch = 0.03 + 0.06 * stride, 0.0
        else:
            lean, crouch = bend_to_reach(
                b.position, b.yaw, b.hands[0].position, b.hands[1].position
            )
        b.lean_rad += (lean - b.lean_rad) * min(1.0, 5.0 * TICK_S)
        b.crouch_m += (crouch - b.crouch_m) * min(1.0, 5.0 * TICK_S)

    def _walk(
        self, world: World, goal: Vector, face_deg: float | None, ignore: str | None = None
    ) -> Script:
        b = self._body
        path = walking_path(self._floor(world, ignore), b.position, goal)
        for index, corner in enumerate(path):
            last = index == len(path) - 1
            while float(np.linalg.norm(corner - b.position)) > ARRIVED_M:
                self._stride_towards(corner, slow_at_end=last)
                yield None
        b.speed_m_s = 0.0
        if face_deg is not None:
            yield from self._face(math.radians(face_deg))

    def _stride_towards(self, corner: Vector, *, slow_at_end: bool) -> None:
        b = self._body
        way = corner - b.position
        distance = float(np.linalg.norm(way))
        error = wrap_angle(math.atan2(way[1], way[0]) - b.yaw)
        b.yaw += float(np.clip(error, -TURN_RATE_RAD_S * TICK_S, TURN_RATE_RAD_S * TICK_S))
        limit = WALKING_SPEED_M_S * max(0.0, math.cos(error)) ** 2
        if abs(error) > 1.0:
            limit = 0.0
        if slow_at_end:
            limit = min(limit, math.sqrt(2.0 * ACCELERATION_M_S2 * distance) + 0.05)
        b.speed_m_s = min(limit, b.speed_m_s + ACCELERATION_M_S2 * TICK_S)
        b.position = towards(b.position, corner, b.speed_m_s * TICK_S)

    def _face(self, yaw: float) -> Script:
        b = self._body
        while abs(error := wrap_angle(yaw - b.yaw)) > 0.02:
            b.yaw += float(np.clip(error, -TURN_RATE_RAD_S * TICK_S, TURN_RATE_RAD_S * TICK_S))
            yield None

    def _stand(self, seconds: float) -> Script:
        for _ in range(round(seconds / TICK_S)):
            yield None

    def _hide(self, world: World, action: Hide) -> Script:
        where = world.object_pose(action.object).translation[:2]
        away = where - self._camera_xy
        distance = float(np.linalg.norm(away))
        spot = self._camera_xy + away / distance * min(0.95, 0.5 * distance)
        yield from self._walk(world, spot, None)
        yield f"hides {action.object}"
        yield from self._stand(action.seconds)

    def _push(self, world: World, action: Push) -> Script:
        item = self._room.object_by_id(action.object)
        grip = side_to_push(item, world.object_pose(action.object), np.array(action.to))
        heading = world.object_pose(action.object).yaw() + grip.object_yaw
        centre = world.object_pose(action.object).translation[:2]
        back_off = grip.depth_m + REACH_M
        yield from self._walk(world, centre - back_off * direction(heading), None, action.object)
        yield from self._face(heading)
        ready = grip.depth_m + HAND_RADIUS_M + 0.04
        self._place_hands(centre, heading, ready, grip)
        yield from self._wait_for_hands()
        for hand in self._body.hands:
            hand.solid = True
        yield f"pushes {action.object}"
        yield from self._drive(world, action, grip, centre - 0.04 * direction(heading), heading)
        yield f"lets go of {action.object}"
        for hand in self._body.hands:
            hand.solid = False
            hand.wanted = None
        yield from self._stand(0.25)

    def _drive(
        self, world: World, action: Push, grip: Grip, centre: Vector, heading: float
    ) -> Script:
        """Push like a car: forward along the heading, steering the object towards the goal."""
        goal = np.array(action.to)
        speed, nearest = 0.0, math.inf
        for _ in range(round(PUSH_TIME_LIMIT_S / TICK_S)):
            pose = world.object_pose(action.object)
            way = goal - pose.translation[:2]
            distance = float(np.linalg.norm(way))
            nearest = min(nearest, distance)
            ahead = float(way @ direction(heading))
            if ahead <= 0.01 or distance > nearest + 0.05 or self._is_stuck(world):
                return
            limit = min(action.speed_m_s, math.sqrt(1.2 * ahead) + 0.03)
            speed = min(limit, speed + 0.8 * TICK_S)
            sine = math.sin(math.atan2(way[1], way[0]) - heading)
            rate = 2.0 * speed * sine / max(distance, 0.15)
            heading += float(np.clip(rate, -STEER_RAD_S, STEER_RAD_S)) * TICK_S
            # Hands that turn faster than the object follows would slip off its side.
            lead = wrap_angle(heading - pose.yaw() - grip.object_yaw)
            heading += float(np.clip(lead, -MAX_LEAD_RAD, MAX_LEAD_RAD)) - lead
            centre = centre + speed * TICK_S * direction(heading)
            self._place_hands(centre, heading, grip.depth_m + HAND_RADIUS_M, grip, PRESS_M)
            self._body.position = centre - (grip.depth_m + REACH_M) * direction(heading)
            self._body.yaw = heading
            for hand in self._body.hands:
                if hand.wanted is not None:
                    hand.position = hand.wanted
            yield None

    def _turn(self, world: World, action: Turn) -> Script:
        item = self._room.object_by_id(action.object)
        pose = world.object_pose(action.object)
        away = pose.translation[:2] - self._body.position
        grip = side_to_push(item, pose, pose.translation[:2] + away)
        heading = pose.yaw() + grip.object_yaw
        centre = pose.translation[:2].copy()
        stand = centre - (grip.depth_m + REACH_M) * direction(heading)
        yield from self._walk(world, stand, None, action.object)
        yield from self._face(heading)
        flank = side_extent(item, grip.object_yaw + 0.5 * math.pi, grip.height_m)
        radius = flank + HAND_RADIUS_M
        gap = 0.04
        total = math.radians(action.by_deg)
        sign = math.copysign(1.0, total)
        # The left hand pushes on the far left corner or the near one, the right hand opposite.
        lever = 0.6 * grip.depth_m
        for hand, side in zip(self._body.hands, SIDES, strict=True):
            hand.wanted = level(
                centre + turned(np.array([-side * sign * lever, side * (radius + gap)]), heading),
                grip.height_m,
            )
        yield from self._wait_for_hands()
        yield f"turns {action.object}"
        for hand in self._body.hands:
            hand.solid = True
        yield from self._twist(total, centre, heading, (lever, radius, grip.height_m))
        yield f"lets go of {action.object}"
        for hand in self._body.hands:
            hand.solid = False
            hand.wanted = None
        yield from self._stand(0.25)

    def _twist(
        self, total: float, centre: Vector, heading: float, hold: tuple[float, float, float]
    ) -> Script:
        """Both hands press in and go round the centre."""
        lever, radius, height = hold
        sign = math.copysign(1.0, total)
        ticks = max(1, round(abs(total) / 1.1 / TICK_S))
        for k in range(ticks + 1):
            angle = heading + total * k / ticks
            pressed = radius + 0.04 - 0.055 * min(1.0, k * TICK_S / 0.15)
            for hand, side in zip(self._body.hands, SIDES, strict=True):
                local = np.array([-side * sign * lever, side * pressed])
                hand.wanted = level(centre + turned(local, angle), height)
                hand.position = hand.wanted
            yield None

    def _carry(self, world: World, action: Carry) -> Script:
        pose = world.object_pose(action.object)
        thickness = self._room.object_by_id(action.object).box_m[2]
        goal = np.array([*action.to, pose.translation[2]])
        yield from self._walk(world, self._beside(world, pose.translation[:2]), None)
        yield from self._face(bearing(self._body.position, pose.translation[:2]))
        hand = self._body.hands[1]
        hold = np.array([0.0, 0.0, thickness + GRASP_HEIGHT_M])
        lift = np.array([0.0, 0.0, LIFT_M])
        yield from self._reach(hand, pose.translation + hold + lift)
        yield from self._reach(hand, pose.translation + hold)
        hand.holds = action.object
        yield f"takes {action.object}"
        yield from self._reach(hand, pose.translation + hold + lift)
        stand = self._beside(world, goal[:2])
        over = goal + hold + lift
        if self._floor(world, None).is_clear(self._body.position, stand):
            yield from self._sidestep(hand, over, stand, math.radians(action.turn_deg))
        else:
            yield from self._bring(world, hand, stand, bearing(stand, goal[:2]))
            yield from self._sidestep(hand, over, stand, math.radians(action.turn_deg))
        yield from self._reach(hand, goal + hold + (0.0, 0.0, RELEASE_GAP_M), speed=0.35)
        yield from self._stand(0.1)
        hand.holds = None
        yield f"puts down {action.object}"
        yield from self._reach(hand, goal + hold + lift)
        hand.wanted = None
        hand.yaw = 0.0
        yield from self._stand(0.3)

    def _sidestep(self, hand: _Hand, over: Vector, stand: Vector, turn: float) -> Script:
        """Move what is held straight to `over` while the feet go straight to `stand`."""
        b = self._body
        from_hand, from_feet, from_yaw, from_turn = hand.position, b.position, b.yaw, hand.yaw
        face = wrap_angle(bearing(stand, over[:2]) - from_yaw)
        seconds = max(
            float(np.linalg.norm(stand - from_feet)) / 0.8,
            float(np.linalg.norm(over - from_hand)) / 0.6,
        )
        ticks = max(1, round(seconds / TICK_S))
        for k in range(1, ticks + 1):
            t = k / ticks
            eased = t * t * (3.0 - 2.0 * t)
            hand.wanted = from_hand + eased * (over - from_hand)
            hand.yaw = from_turn + eased * (turn - from_turn)
            b.position = from_feet + eased * (stand - from_feet)
            b.yaw = from_yaw + eased * face
            yield None

    def _bring(self, world: World, hand: _Hand, stand: Vector, face: float) -> Script:
        """Walk to `stand` with what is held in front of the chest."""
        b = self._body
        turned_at_start = b.yaw - hand.yaw
        way = self._walk(world, stand, math.degrees(face))
        for said in way:
            chest = Pose.from_yaw(b.yaw, (*b.position, 0.0)) @ CARRIED_AT_M
            hand.wanted = chest
            hand.yaw = b.yaw - turned_at_start
            yield said

    def _reach(self, hand: _Hand, point: Vector, speed: float = 0.7) -> Script:
        hand.wanted = hand.position if hand.wanted is None else hand.wanted
        while float(np.linalg.norm(point - hand.wanted)) > 1e-6:
            hand.wanted = towards(hand.wanted, point, speed * TICK_S)
            yield None
        while float(np.linalg.norm(point - hand.position)) > 1e-3:
            yield None
        yield from self._stand(0.06)

    def _wait_for_hands(self) -> Script:
        for _ in range(200):
            if all(
                hand.wanted is None or np.linalg.norm(hand.wanted - hand.position) < 5e-3
                for hand in self._body.hands
            ):
                return
            yield None

    def _place_hands(
        self, centre: Vector, heading: float, behind_m: float, grip: Grip, press_m: float = 0.0
    ) -> None:
        for hand, side in zip(self._body.hands, SIDES, strict=True):
            local = np.array([-behind_m, side * grip.half_spread_m])
            hand.wanted = level(centre + turned(local, heading), grip.height_m - press_m)

    def _is_stuck(self, world: World) -> bool:
        """Whether a hand has been held back by something that does not give way."""
        return any(
            float(np.linalg.norm(world.hand_position(self.person_id, name) - hand.position))
            > STUCK_M
            for name, hand in zip(("left", "right"), self._body.hands, strict=True)
        )

    def _beside(self, world: World, point: Vector) -> Vector:
        """Free floor near `point`, and near where the person already is if that is in reach."""
        floor = self._floor(world, None)
        centres = floor.centres()[floor.free.ravel()]
        reach = np.linalg.norm(centres - point, axis=1)
        way = np.linalg.norm(centres - self._body.position, axis=1)
        cost = reach + 0.5 * way + 10.0 * np.maximum(reach - COMFORTABLE_REACH_M, 0.0)
        return centres[int(np.argmin(cost))]

    def _floor(self, world: World, ignore: str | None) -> FreeFloor:
        obstacles = [(self._camera_xy, CAMERA_MARGIN_M)]
        for item in self._room.objects:
            position = world.object_pose(item.object_id).translation
            if position[2] < 0.3 and item.object_id != ignore:
                obstacles.append((position[:2], 0.5 * max(item.box_m[:2])))
        if ignore is not None:
            item = self._room.object_by_id(ignore)
            radius = 0.5 * min(item.box_m[:2])
            obstacles.append((world.object_pose(ignore).translation[:2], radius))
        return free_floor(self._room, obstacles)
