"""Shown pose of one that is estimated anew: it glides there, and never jumps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from scenes.pose import Pose, rotation_angle, rotation_from_vector

SPEED_M_PER_S, SPEED_RAD_PER_S = 0.02, math.radians(0.5)
"""Speeds at which a small correction is shown, chosen: 5 mm in a quarter of a second, which nobody
notices of a thing that is looked at."""

SETTLES_S = 0.7
"""Time constant of a large correction, seconds: nine tenths are over in 1.6 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Glide:
    """A shown pose on its way.

    Attributes:
        b_from_a: the pose that is shown.
        t_ns: when.
    """

    b_from_a: Pose
    t_ns: int


def glided(known: Glide | None, b_from_a: Pose, *, t_ns: int, about: np.ndarray) -> Glide:
    """Return what is shown at a later time of a pose that is wanted.

    Args:
        known: what was shown; None begins at once.
        b_from_a: the estimate.
        t_ns: when it is to be shown.
        about: (3,) in a: a place whose way counts, near what people look at.
    """
    if known is None:
        return Glide(b_from_a, t_ns)
    passed_s = max(t_ns - known.t_ns, 0) * 1e-9
    if passed_s == 0.0:
        return known
    turn = b_from_a.rotation @ known.b_from_a.rotation.T
    way = b_from_a @ about - known.b_from_a @ about
    length, angle = float(np.linalg.norm(way)), rotation_angle(turn)
    share = min(
        _share(length, SPEED_M_PER_S, passed_s=passed_s),
        _share(angle, SPEED_RAD_PER_S, passed_s=passed_s),
    )
    vector = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64).ravel()
    rotation = rotation_from_vector(share * vector) @ known.b_from_a.rotation
    place = known.b_from_a @ about + share * way
    return Glide(Pose(rotation, place - rotation @ about), t_ns)


def _share(left: float, speed: float, *, passed_s: float) -> float:
    """Return the share of what is left that is gone in some seconds, at most all of it."""
    if left < 1e-9:
        return 1.0
    settled = 1.0 - math.exp(-passed_s / SETTLES_S)
    return min(1.0, max(settled, speed * passed_s / left))
