"""To push and to turn objects with both hands, by contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.mesh import PhysicalObject
from scenes.pose import Pose, wrap_angle
from sim.bodies import UNIT_BOX_CORNERS
from sim.navigation.planar import Vector, bearing, direction, level, turn_vector
from sim.people.acts.reaching import let_hang, wait_for_hands
from sim.people.acts.walking import face, stand, walk_to
from sim.people.person import TICK_S, Person, Script
from sim.people.posture import SIDES
from sim.physics.moving.people import HAND_RADIUS_M
from sim.scenarios.actions import Push, Turn

REACH_M = 0.42

PUSH_TIME_LIMIT_S = 12.0

PRESS_M = 0.006
"""Metres below their own height at which pushing hands aim, chosen: pressing down on the near edge
keeps objects upright."""

STEER_RAD_S = 0.6

MAX_LEAD_RAD = 0.15

HAND_HEIGHT_M = 0.455

SEAT_SHARE = 0.965

HAND_SPREAD_SHARE = 0.28

FLAT_M = 0.06
"""Difference in depth up to which a side counts as flat: of a round seat."""


def push(person: Person, action: Push) -> Script:
    """Go behind an object and push it."""
    pose = person.physics.object_pose(action.object)
    grip = side_to_push(person.room.object_by_id(action.object), pose, np.array(action.to))
    heading = pose.yaw() + grip.object_yaw
    centre = pose.translation[:2]
    back_off = grip.depth_m + REACH_M
    yield from walk_to(person, centre - back_off * direction(heading), ignore=action.object)
    yield from face(person, heading)
    ready = grip.depth_m + HAND_RADIUS_M + 0.04
    _place_hands(person, grip, centre=centre, heading=heading, behind_m=ready)
    yield from wait_for_hands(person)
    for hand in person.body.hands:
        hand.solid = True
    yield f"pushes {action.object}"
    yield from _drive(person, action, grip=grip, centre=centre, heading=heading)
    yield f"lets go of {action.object}"
    let_hang(person)
    yield from stand(0.25)


def _drive(person: Person, action: Push, *, grip: Grip, centre: Vector, heading: float) -> Script:
    """Push like a car: forward along the heading, steering the object towards the goal."""
    goal = np.array(action.to)
    centre = centre - 0.04 * direction(heading)
    speed, nearest = 0.0, math.inf
    for _ in range(round(PUSH_TIME_LIMIT_S / TICK_S)):
        pose = person.physics.object_pose(action.object)
        way = goal - pose.translation[:2]
        distance = float(np.linalg.norm(way))
        nearest = min(nearest, distance)
        ahead = float(way @ direction(heading))
        if ahead <= 0.01 or distance > nearest + 0.05 or person.is_stuck():
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
        behind = grip.depth_m + HAND_RADIUS_M
        _place_hands(person, grip, centre=centre, heading=heading, behind_m=behind, press_m=PRESS_M)
        person.body.position = centre - (grip.depth_m + REACH_M) * direction(heading)
        person.body.yaw = heading
        for hand in person.body.hands:
            if hand.wanted is not None:
                hand.position = hand.wanted
        yield None


def turn(person: Person, action: Turn) -> Script:
    """Take an object by two sides and turn it."""
    item = person.room.object_by_id(action.object)
    pose = person.physics.object_pose(action.object)
    away = pose.translation[:2] - person.body.position
    grip = side_to_push(item, pose, pose.translation[:2] + away)
    heading = pose.yaw() + grip.object_yaw
    centre = pose.translation[:2].copy()
    place = centre - (grip.depth_m + REACH_M) * direction(heading)
    yield from walk_to(person, place, ignore=action.object)
    yield from face(person, heading)
    flank = side_extent(item, grip.object_yaw + 0.5 * math.pi, grip.above_base_m)
    radius = flank + HAND_RADIUS_M
    gap = 0.04
    total = math.radians(action.by_deg)
    sign = math.copysign(1.0, total)
    # The left hand pushes on the far left corner or the near one, the right hand opposite.
    lever = 0.6 * grip.depth_m
    for hand, side in zip(person.body.hands, SIDES, strict=True):
        hand.wanted = level(
            centre + turn_vector(np.array([-side * sign * lever, side * (radius + gap)]), heading),
            grip.height_m,
        )
    yield from wait_for_hands(person)
    yield f"turns {action.object}"
    for hand in person.body.hands:
        hand.solid = True
    hold = (lever, radius, grip.height_m)
    yield from _twist(person, total, centre=centre, heading=heading, hold=hold)
    yield f"lets go of {action.object}"
    let_hang(person)
    yield from stand(0.25)


def _twist(
    person: Person,
    total: float,
    *,
    centre: Vector,
    heading: float,
    hold: tuple[float, float, float],
) -> Script:
    """Both hands press in and go round the centre."""
    lever, radius, height = hold
    sign = math.copysign(1.0, total)
    ticks = max(1, round(abs(total) / 1.1 / TICK_S))
    for k in range(ticks + 1):
        angle = heading + total * k / ticks
        pressed = radius + 0.04 - 0.055 * min(1.0, k * TICK_S / 0.15)
        for hand, side in zip(person.body.hands, SIDES, strict=True):
            local = np.array([-side * sign * lever, side * pressed])
            hand.wanted = level(centre + turn_vector(local, angle), height)
            hand.position = hand.wanted
        yield None


def _place_hands(
    person: Person,
    grip: Grip,
    *,
    centre: Vector,
    heading: float,
    behind_m: float,
    press_m: float = 0.0,
) -> None:
    for hand, side, further in zip(person.body.hands, SIDES, grip.further_m, strict=True):
        local = np.array([further - behind_m, side * grip.half_spread_m])
        hand.wanted = level(centre + turn_vector(local, heading), grip.height_m - press_m)


@dataclass(frozen=True, slots=True)
class Grip:
    """How an object is pushed.

    Attributes:
        object_yaw: heading of the push in the object's frame, radians; a multiple of 90°.
        depth_m: from the centre back to the surface the hands touch.
        half_spread_m: half the distance between the hands.
        height_m: of the hands above the floor.
        above_base_m: of the hands above the object's base.
        further_m: how much further in than the others the left and the right hand reach, where the
            object's side is not flat.
    """

    object_yaw: float
    depth_m: float
    half_spread_m: float
    height_m: float
    above_base_m: float
    further_m: tuple[float, float] = (0.0, 0.0)


def side_to_push(item: PhysicalObject, world_from_object: Pose, goal: Vector) -> Grip:
    """The side from which the goal lies most nearly straight ahead."""
    ahead = bearing(world_from_object.translation[:2], goal)
    quarter = 0.5 * math.pi
    object_yaw = quarter * round((ahead - world_from_object.yaw()) / quarter)
    height = _touchable(item, min(HAND_HEIGHT_M, SEAT_SHARE * item.box_m[2]))
    width = item.box_m[1] if round(object_yaw / quarter) % 2 == 0 else item.box_m[0]
    depth = side_extent(item, object_yaw + math.pi, height)
    half_spread = HAND_SPREAD_SHARE * width
    left, right = (
        _recess(item, object_yaw + math.pi, depth_m=depth, aside_m=aside, height_m=height)
        for aside in (-half_spread, half_spread)
    )
    return Grip(
        wrap_angle(object_yaw),
        depth,
        half_spread,
        float(world_from_object.translation[2]) + height,
        height,
        (left, right),
    )


def side_extent(item: PhysicalObject, object_yaw: float, height_m: float) -> float:
    """How far the boxes at hand height reach from the centre in a direction, metres."""
    axis = direction(object_yaw)
    reaches = [
        float((corners[:, :2] @ axis).max())
        for corners in _corners(item)
        if _is_at(corners, height_m)
    ]
    return max(reaches) if reaches else 0.5 * max(item.box_m[:2])


def _recess(
    item: PhysicalObject, object_yaw: float, *, depth_m: float, aside_m: float, height_m: float
) -> float:
    """How far behind the outermost point of a side its surface lies at one hand, metres.

    Args:
        item: what is pushed.
        object_yaw: of the side, in the object's frame.
        depth_m: of its outermost point.
        aside_m: of the hand, to the left of the side's direction.
        height_m: of the hand above the base.
    """
    out, left = direction(object_yaw), direction(object_yaw + 0.5 * math.pi)
    reaches = [
        float((corners[:, :2] @ out).max())
        for corners in _corners(item)
        if _is_at(corners, height_m)
        and (corners[:, :2] @ left).min() < aside_m < (corners[:, :2] @ left).max()
    ]
    recess = depth_m - max(reaches, default=depth_m)
    return recess if recess > FLAT_M else 0.0


def _touchable(item: PhysicalObject, height_m: float) -> float:
    """A height at which there is something to push: as given, or the middle of the nearest part."""
    boxes = _corners(item)
    if not boxes or any(_is_at(corners, height_m) for corners in boxes):
        return height_m
    middles = [0.5 * float(c[:, 2].min() + c[:, 2].max()) for c in boxes]
    return min(middles, key=lambda middle: abs(middle - height_m))


def _corners(item: PhysicalObject) -> list[Vector]:
    """(8, 3) corners of each solid part, in the object's frame."""
    return [
        part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m))
        for part in item.parts
    ]


def _is_at(corners: Vector, height_m: float) -> bool:
    """Whether a hand at a height touches the part with these corners."""
    low, high = corners[:, 2].min(), corners[:, 2].max()
    reach = 0.7 * HAND_RADIUS_M
    return bool(low < height_m + reach and high > height_m - reach)
