"""Places at which hands push an object: side, height and distance apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.mesh import PhysicalObject
from scenes.pose import Pose, wrap_angle
from sim.bodies import UNIT_BOX_CORNERS
from sim.navigation.planar import Vector, bearing, direction
from sim.physics.moving.people import HAND_RADIUS_M

HAND_HEIGHT_M = 0.455
SEAT_SHARE = 0.965
HAND_SPREAD_SHARE = 0.28
FLAT_M = 0.06
"""Difference in depth up to which a side counts as flat: of a round seat."""


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
