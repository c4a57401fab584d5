"""Poses at which a camera may stand: places of a map, turned and tilted as the picture fits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from tracking.camera.locating.panorama import live_panorama
from tracking.camera.locating.room_map import RoomMap, scores, turned

TILTS = ((0.0, 1), (5.0, 6), (10.0, 12))
"""Tilts that are compared: degrees, and how many directions of them. Neighbours are 5° apart; a
panorama is smoothed by 3°."""

HYPOTHESES = 6
"""How many are refined. In 27 of 28 pictures of six rooms the right one was the first or second, in
one the third; each takes about a tenth of the whole time."""

APART_M = 0.8
"""Distance in metres between two hypotheses with nearly the same turn: more than one and a half
steps of the map's grid."""

APART_RAD = math.radians(30.0)
"""Turn between two hypotheses at nearly the same place; refinement reaches 14°."""

MAX_COMPARED = 20_000
"""Scores, best first, among which hypotheses are looked for: about one in a thousand."""


def hypotheses(room_map: RoomMap, frame: Frame) -> list[Pose]:
    """`world_from_rig` of the likeliest poses that differ, best first.

    Args:
        room_map: what is seen from places in the room.
        frame: pictures of all lenses.
    """
    upright = [Pose(tilt @ WORLD_FROM_FORWARD_CAMERA.rotation, np.zeros(3)) for tilt in _tilts()]
    score = scores(room_map, [live_panorama(frame, pose) for pose in upright])
    count = min(MAX_COMPARED, score.size)
    best = np.argpartition(score.ravel(), -count)[-count:]
    best = best[np.argsort(score.ravel()[best])[::-1]]
    chosen: list[Pose] = []
    which = np.stack(np.unravel_index(best, score.shape), axis=1)
    for place, tilt, column in which:
        turn = turned(int(column))
        pose = Pose(turn.rotation @ upright[int(tilt)].rotation, room_map.places[int(place)])
        if all(is_apart(pose, other) for other in chosen):
            chosen.append(pose)
        if len(chosen) == HYPOTHESES:
            break
    return chosen


def is_apart(world_from_rig: Pose, world_from_other: Pose) -> bool:
    """Whether two poses are different places to stand, and not one seen with an error."""
    step = world_from_rig.inverse() @ world_from_other
    return (
        float(np.linalg.norm(step.translation)) > APART_M
        or rotation_angle(step.rotation) > APART_RAD
    )


def _tilts() -> list[NDArray[np.float64]]:
    """Rotations of a level camera about horizontal axes."""
    return [
        rotation_from_vector(math.radians(degrees) * np.array([math.cos(at), math.sin(at), 0.0]))
        for degrees, count in TILTS
        for at in 2.0 * math.pi * np.arange(count) / count
    ]
