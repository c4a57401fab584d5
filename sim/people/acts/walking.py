"""To walk around what stands in the way, to face something, to stand, to hide something."""

from __future__ import annotations

import math

import numpy as np

from scenes.pose import wrap_angle
from sim.navigation.paths import has_way, walking_path
from sim.navigation.planar import towards
from sim.people.person import TICK_S, Person, Script, Vector
from sim.people.posture import WALKING_SPEED_M_S
from sim.scenarios.actions import Hide, Walk

TURN_RATE_RAD_S = 3.2
ACCELERATION_M_S2 = 2.5
ARRIVED_M = 0.03


class NoWayError(ValueError):
    """Somewhere nobody can walk to; the message says where and from where."""


def walk(person: Person, action: Walk) -> Script:
    """Go to a place, and face where the action says."""
    yield from walk_to(person, np.array(action.to))
    if action.face_deg is not None:
        yield from face(person, math.radians(action.face_deg))


def walk_to(person: Person, goal: Vector, *, ignore: str | None = None) -> Script:
    """Go to a place.

    Args:
        person: who.
        goal: (x, y).
        ignore: an object that may be approached.

    Raises:
        NoWayError: walls and furniture are in the way.
    """
    b = person.body
    for index, corner in enumerate(path := _path(person, goal, ignore)):
        last = index == len(path) - 1
        while float(np.linalg.norm(corner - b.position)) > ARRIVED_M:
            _stride_towards(person, corner, slow_at_end=last)
            yield None
    b.speed_m_s = 0.0


def face(person: Person, yaw: float) -> Script:
    """Turn on the spot, radians from world x."""
    b = person.body
    while abs(error := wrap_angle(yaw - b.yaw)) > 0.02:
        b.yaw += float(np.clip(error, -TURN_RATE_RAD_S * TICK_S, TURN_RATE_RAD_S * TICK_S))
        yield None


def stand(seconds: float) -> Script:
    """Let time pass."""
    for _ in range(round(seconds / TICK_S)):
        yield None


def hide(person: Person, action: Hide) -> Script:
    """Stand between the camera and an object."""
    where = person.physics.object_pose(action.object).translation[:2]
    away = where - person.camera_xy
    distance = float(np.linalg.norm(away))
    spot = person.camera_xy + away / distance * min(0.95, 0.5 * distance)
    yield from walk_to(person, spot)
    yield f"hides {action.object}"
    yield from stand(action.seconds)


def _path(person: Person, goal: Vector, ignore: str | None) -> list[Vector]:
    """Around everything; where movable objects bar the way, around what never moves."""
    here, floor = person.body.position, person.floor(ignore=ignore)
    if has_way(floor, here, goal):
        return walking_path(floor, here, goal)
    bare = person.floor_map.bare
    if not has_way(bare, here, goal):
        raise NoWayError(
            f"no way from [{here[0]:.2f}, {here[1]:.2f}] to [{goal[0]:.2f}, {goal[1]:.2f}]: "
            "walls or furniture are in between"
        )
    return walking_path(bare, here, goal)


def _stride_towards(person: Person, corner: Vector, *, slow_at_end: bool) -> None:
    b = person.body
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
