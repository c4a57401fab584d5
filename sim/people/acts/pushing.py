"""To push and to turn objects with both hands, by contact."""

from __future__ import annotations

import math

import numpy as np

from scenes.pose import wrap_angle
from sim.navigation.planar import direction, level, turn_vector
from sim.people.acts.grip import Grip, side_extent, side_to_push
from sim.people.acts.reaching import let_hang, wait_for_hands
from sim.people.acts.walking import face, stand, walk_to
from sim.people.person import TICK_S, Person, Script, Vector
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
