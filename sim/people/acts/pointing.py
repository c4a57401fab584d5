"""To point at something, and to draw a line in the air or on a surface."""

from __future__ import annotations

import numpy as np

from scenes.state import Annotation
from sim.navigation.planar import bearing
from sim.people.acts.reaching import let_hang
from sim.people.acts.walking import face
from sim.people.drawn_line import drawn_part, length_m
from sim.people.person import TICK_S, Person, Script, Vector, shoulder
from sim.scenarios.actions import Draw, Point

ARM_M = 0.56
"""Reach of a stretched arm from the shoulder to the middle of the hand."""
RIGHT = -1.0


def point(person: Person, action: Point) -> Script:
    """Stretch the right arm at an object, which may move, or at a place."""
    yield from face(person, bearing(person.body.position, _target(person, action)[:2]))
    yield f"points at {action.object or list(action.at or ())}"
    for _ in range(round(action.seconds / TICK_S)):
        _aim(person, _target(person, action))
        yield None
    _lower(person)
    yield None


def draw(person: Person, action: Draw) -> Script:
    """Follow a line with the hand, or with a ray where it is out of reach; the line stays."""
    points = np.array(action.points)
    yield from face(person, bearing(person.body.position, points[0, :2]))
    name = f"{person.person_id}-{1 + len(person.drawings)}"
    for _ in range(round(0.5 / TICK_S)):
        _aim(person, points[0])
        yield None
    yield f"draws {name}"
    ticks = max(1, round(length_m(points) / action.speed_m_s / TICK_S))
    for k in range(1, ticks + 1):
        line = drawn_part(points, k / ticks)
        _aim(person, line[-1])
        person.drawings[name] = Annotation(name, person.person_id, line, action.colour)
        yield None
    _lower(person)
    yield f"has drawn {name}"


def _target(person: Person, action: Point) -> Vector:
    if action.object is None:
        return np.array(action.at)
    half = 0.5 * person.room.object_by_id(action.object).box_m[2]
    return person.physics.object_pose(action.object) @ np.array([0.0, 0.0, half])


def _aim(person: Person, target: Vector) -> None:
    """The right hand towards a point (3,), and the ray from it to there."""
    start = shoulder(person, RIGHT)
    way = target - start
    distance = float(np.linalg.norm(way))
    hand = person.body.hands[1]
    hand.wanted = start + way * (min(ARM_M, distance) / max(distance, 1e-6))
    person.ray = np.stack([hand.position, target])


def _lower(person: Person) -> None:
    person.ray = None
    let_hang(person)
