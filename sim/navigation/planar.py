"""Small geometry on the floor: directions and places as (x, y) in world metres."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def direction(yaw: float) -> Vector:
    """(2,) unit vector at an angle from world x, radians."""
    return np.array([math.cos(yaw), math.sin(yaw)])


def bearing(from_xy: Vector, to_xy: Vector) -> float:
    """Angle from world x of the way from one place to another, radians."""
    way = to_xy - from_xy
    return math.atan2(float(way[1]), float(way[0]))


def turn_vector(local: Vector, yaw: float) -> Vector:
    """A (2,) vector turned anticlockwise."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([c * local[0] - s * local[1], s * local[0] + c * local[1]])


def level(xy: Vector, height_m: float) -> Vector:
    """(3,) point above a place (2,)."""
    return np.array([xy[0], xy[1], height_m])


def towards(here: Vector, goal: Vector, step_m: float) -> Vector:
    """The point at most `step_m` from `here` on the way to `goal`; any dimension."""
    way = goal - here
    distance = float(np.linalg.norm(way))
    return goal.copy() if distance <= step_m else here + way * (step_m / distance)
