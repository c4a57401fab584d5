"""A remote user's avatar: a head that strolls along a path and points at objects."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Avatar
from sim.scenario import RemoteSettings

POINTING_SHARE = 0.6
HAND_OFFSET_M = (0.22, 0.35, 0.25)
"""Right of, below and in front of the head."""

POINT_ON_OBJECT_M = np.array([0.0, 0.0, 0.2])


def remote_avatar(
    settings: RemoteSettings,
    fraction: float,
    objects: Mapping[str, Pose],
    world_from_default_look: Pose,
) -> Avatar:
    """The avatar at one moment.

    Args:
        settings: path and what is pointed at.
        fraction: 0..1 of the scenario.
        objects: `world_from_object` by id, to look and point at.
        world_from_default_look: looked at when there is nothing to point at.
    """
    path = np.array(settings.path)
    along = np.clip(fraction, 0.0, 1.0) * (len(path) - 1)
    index = min(int(along), max(len(path) - 2, 0))
    following = path[min(index + 1, len(path) - 1)]
    eye = path[index] + (along - index) * (following - path[index])
    target, ray = world_from_default_look.translation, None
    if settings.points_at:
        turn = min(fraction, 1.0 - 1e-9) * len(settings.points_at)
        target = objects[settings.points_at[int(turn)]] @ POINT_ON_OBJECT_M
        head = look_at(eye, target)
        if turn % 1.0 < POINTING_SHARE:
            hand = head @ np.array([HAND_OFFSET_M])
            ray = np.concatenate([hand, [target]])
    return Avatar(settings.user_id, "remote", look_at(eye, target), ray=ray)
