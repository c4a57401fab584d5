"""Feet for a scanned object whose legs the scan has missed: what stood in the room can stand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenes.mesh import BoxPart
from scenes.pose import Pose
from sim.bodies import UNIT_BOX_CORNERS

GROUND_M = 0.003
"""Height below which a part reaches the ground: what the cut's cells round to."""
OUT_SHARE = 0.7
"""Share of half the box at which a corner has to be carried: legs stand a little inwards."""
FOOT_SHARE = 0.12
"""Side of a foot as a share of the box's shorter side."""
TALLEST_SHARE = 0.5
"""Height of a foot as a share of the box's: a foot that stands alone carries as well."""


def with_feet(parts: Sequence[BoxPart], box_m: tuple[float, float, float]) -> tuple[BoxPart, ...]:
    """The parts, and a foot in each corner in which none of them reaches the ground.

    Args:
        parts: solid boxes in the object's frame, whose ground is z = 0.
        box_m: extents of the object, metres.
    """
    bounds = [
        part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m)) for part in parts
    ]
    low = np.array([corners.min(axis=0) for corners in bounds])
    high = np.array([corners.max(axis=0) for corners in bounds])
    feet: list[BoxPart] = []
    out = OUT_SHARE * 0.5 * np.asarray(box_m[:2])
    side = FOOT_SHARE * min(box_m[:2])
    for sign in ((-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)):
        signs = np.array(sign)
        reach = np.where(signs > 0.0, high[:, :2], -low[:, :2])
        is_carried = (reach >= out).all(axis=1) & (low[:, 2] < GROUND_M)
        if is_carried.any():
            continue
        there = (reach > 0.0).all(axis=1)
        above = float(low[there, 2].min()) if there.any() else 0.0
        height = float(np.clip(above, 2.0 * GROUND_M, TALLEST_SHARE * box_m[2]))
        x, y = signs * (out + 0.5 * side)
        half = (0.5 * side, 0.5 * side, 0.5 * height)
        feet.append(BoxPart(Pose.from_yaw(0.0, (x, y, 0.5 * height)), half))
    return (*parts, *feet)
