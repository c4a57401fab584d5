"""Attention of people in a room: which object each points at, and which they look at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.state import Avatar

GAZE_RAD = float(np.radians(10.0))
"""Half angle of the cone in which something is looked at, by the head alone. Eyes turn from the
head's middle by less than that nine times in ten where people walk about (Foulsham and others,
2011); a headset without eye tracking knows no more."""

POINT_SLACK_M = 0.05
"""How far beside an object's sphere a ray may pass, metres; chosen: a hand's tremor across a
room."""

Sphere = tuple[NDArray[np.float64], float]
"""Centre (3,) in the world and radius in metres of what holds an object."""


@dataclass(frozen=True, slots=True)
class Attention:
    """Attention of one person.

    Attributes:
        user_id: of the person.
        points_at: object that their ray meets first; empty where it meets none.
        looks_at: object nearest to the middle of their view; empty where none is near it.
    """

    user_id: str
    points_at: str = ""
    looks_at: str = ""


def attention_of(avatar: Avatar, spheres: Mapping[str, Sphere]) -> Attention:
    """Return what somebody points and looks at.

    Args:
        avatar: the person.
        spheres: what holds each object, by its id.
    """
    return Attention(avatar.user_id, _pointed_at(avatar, spheres), _looked_at(avatar, spheres))


def _pointed_at(avatar: Avatar, spheres: Mapping[str, Sphere]) -> str:
    if avatar.ray is None:
        return ""
    start, end = avatar.ray
    way = end - start
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        return ""
    way = way / length
    met: dict[str, float] = {}
    for name, (centre, radius) in spheres.items():
        along = float(np.clip((centre - start) @ way, 0.0, length))
        beside = float(np.linalg.norm(start + along * way - centre))
        if beside <= radius + POINT_SLACK_M:
            # What the ray ends in is meant more than what it passes: by its end, then by its side.
            met[name] = float(np.linalg.norm(end - centre)) + beside
    return min(met, key=met.__getitem__, default="")


def _looked_at(avatar: Avatar, spheres: Mapping[str, Sphere]) -> str:
    eye, ahead = avatar.world_from_head.translation, avatar.world_from_head.rotation[:, 2]
    off: dict[str, float] = {}
    for name, (centre, radius) in spheres.items():
        way = centre - eye
        distance = float(np.linalg.norm(way))
        if distance < 1e-6:
            continue
        angle = float(np.arccos(np.clip(way @ ahead / distance, -1.0, 1.0)))
        # From its edge on: something large is looked at beside its middle, too.
        edge = float(np.arcsin(min(radius / distance, 1.0)))
        if angle - edge <= GAZE_RAD:
            off[name] = angle
    return min(off, key=off.__getitem__, default="")
