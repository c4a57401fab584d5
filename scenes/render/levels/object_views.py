"""Pictures of one object from all around it, in its own frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.splats import SplatCloud

DIRECTIONS = 32
SIDES_PX = (200, 80)
"""Sides of the pictures, in turn: an object near the camera and one far from it."""

FIELD_OF_VIEW = math.radians(40.0)
HELD_SHARE = 0.98
"""Share of the splats, those nearest the middle, that decide how far away the views are."""

MARGIN = 1.15
"""Around them, for the splats' own size and the few further out."""


@dataclass(frozen=True, slots=True)
class ObjectView:
    """A picture of an object: the camera and where it stands in the object's frame."""

    camera: Pinhole | Fisheye
    object_from_camera: Pose


def views_around(
    cloud: SplatCloud, *, count: int = DIRECTIONS, sides_px: Sequence[int] = SIDES_PX
) -> tuple[ObjectView, ...]:
    """Square views of the whole object, spread evenly over all directions (a Fibonacci sphere).

    Splats that are damaged or far from most others don't move the views.

    Args:
        cloud: the object.
        count: how many views.
        sides_px: widths of the pictures, taken in turn.
    """
    middle, radius = _ball(cloud)
    distance = MARGIN * radius / math.sin(0.5 * FIELD_OF_VIEW)
    steps = np.arange(count)
    heights = 1 - (2 * steps + 1) / count
    turns = steps * math.pi * (3 - math.sqrt(5))
    across = np.sqrt(1 - heights**2)
    outward = np.stack([across * np.cos(turns), across * np.sin(turns), heights], axis=1)
    cameras = [Pinhole.from_fov(side, side, FIELD_OF_VIEW) for side in sides_px]
    return tuple(
        ObjectView(cameras[k % len(cameras)], look_at(middle + distance * direction, middle))
        for k, direction in enumerate(outward)
    )


def _ball(cloud: SplatCloud) -> tuple[NDArray[np.float64], float]:
    """Middle and radius (metres) of what holds most splats."""
    sound = cloud.means[np.isfinite(cloud.means).all(axis=1)].astype(np.float64)
    if len(sound) == 0:
        return np.zeros(3), 1.0
    middle = np.median(sound, axis=0)
    distances = np.linalg.norm(sound - middle, axis=1)
    return middle, max(float(np.quantile(distances, HELD_SHARE)), 1e-3)
