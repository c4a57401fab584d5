"""Where hands touch an object to push it: which side, how high, how far apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.mesh import PhysicalObject
from scenes.pose import Pose, wrap_angle
from sim.bodies import UNIT_BOX_CORNERS
from sim.planar import Vector, bearing, direction
from sim.people.embodiment import HAND_RADIUS_M

HAND_HEIGHT_M = 0.455
SEAT_SHARE = 0.965
HAND_SPREAD_SHARE = 0.28


@dataclass(frozen=True, slots=True)
class Grip:
    """How an object is pushed.

    Attributes:
        object_yaw: heading of the push in the object's frame, radians; a multiple of 90°.
        depth_m: from the centre back to the surface the hands touch.
        half_spread_m: half the distance between the hands.
        height_m: of the hands above the floor.
    """

    object_yaw: float
    depth_m: float
    half_spread_m: float
    height_m: float


def side_to_push(item: PhysicalObject, world_from_object: Pose, goal: Vector) -> Grip:
    """The side from which the goal lies most nearly straight ahead."""
    ahead = bearing(world_from_object.translation[:2], goal)
    quarter = 0.5 * math.pi
    object_yaw = quarter * round((ahead - world_from_object.yaw()) / quarter)
    height = min(HAND_HEIGHT_M, SEAT_SHARE * item.box_m[2])
    width = item.box_m[1] if round(object_yaw / quarter) % 2 == 0 else item.box_m[0]
    return Grip(
        wrap_angle(object_yaw),
        side_extent(item, object_yaw + math.pi, height),
        HAND_SPREAD_SHARE * width,
        float(world_from_object.translation[2]) + height,
    )


def side_extent(item: PhysicalObject, object_yaw: float, height_m: float) -> float:
    """How far the boxes at hand height reach from the centre in a direction, metres."""
    axis = direction(object_yaw)
    reaches: list[float] = []
    for part in item.parts:
        corners = part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m))
        low, high = corners[:, 2].min(), corners[:, 2].max()
        if low < height_m + 0.7 * HAND_RADIUS_M and high > height_m - 0.7 * HAND_RADIUS_M:
            reaches.append(float((corners[:, :2] @ axis).max()))
    return max(reaches) if reaches else 0.5 * max(item.box_m[:2])
