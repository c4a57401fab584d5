"""A remote user's avatar: a head that strolls along a path, points at objects and draws."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Annotation, Avatar
from sim.people.drawn_line import drawn_part
from sim.scenarios.scenario import RemoteDrawing, RemoteSettings

POINTING_SHARE = 0.6
HAND_OFFSET_M = (0.22, 0.35, 0.25)
"""Right of, below and in front of the head."""


def remote_avatar(
    settings: RemoteSettings,
    fraction: float,
    objects: Mapping[str, Pose],
    world_from_default_look: Pose,
    *,
    t_s: float = 0.0,
) -> Avatar:
    """The avatar at one moment.

    Args:
        settings: path and what is pointed at.
        fraction: 0..1 of the scenario.
        objects: `world_from_object` by id, to look and point at.
        world_from_default_look: looked at when there is nothing to point at.
        t_s: time since the scenario began, for what is drawn.
    """
    path = np.array(settings.path)
    along = np.clip(fraction, 0.0, 1.0) * (len(path) - 1)
    index = min(int(along), max(len(path) - 2, 0))
    following = path[min(index + 1, len(path) - 1)]
    eye = path[index] + (along - index) * (following - path[index])
    target, ray = world_from_default_look.translation, None
    if settings.points_at:
        turn = min(fraction, 1.0 - 1e-9) * len(settings.points_at)
        target = objects[settings.points_at[int(turn)]] @ np.array([0.0, 0.0, settings.aim_m])
        head = look_at(eye, target)
        if turn % 1.0 < POINTING_SHARE:
            hand = head @ np.array([HAND_OFFSET_M])
            ray = np.concatenate([hand, [target]])
    pen = next((line[-1] for d in settings.draws if (line := _line(d, t_s)) is not None), None)
    if pen is not None:
        target = pen
        ray = np.concatenate([look_at(eye, pen) @ np.array([HAND_OFFSET_M]), [pen]])
    return Avatar(settings.user_id, "remote", look_at(eye, target), ray=ray)


def remote_annotations(
    settings: RemoteSettings, *, since_s: float, t_s: float
) -> tuple[Annotation, ...]:
    """Return those of a remote user's lines that have grown since some time."""
    found: list[Annotation] = []
    for k, drawing in enumerate(settings.draws):
        if drawing.from_s < t_s and since_s < drawing.from_s + drawing.seconds:
            line = drawn_part(np.array(drawing.points), (t_s - drawing.from_s) / drawing.seconds)
            name = f"{settings.user_id}-{1 + k}"
            found.append(Annotation(name, settings.user_id, line, drawing.colour))
    return tuple(found)


def _line(drawing: RemoteDrawing, t_s: float) -> NDArray[np.float64] | None:
    """A line as it is while it is drawn, or None before and after."""
    share = (t_s - drawing.from_s) / drawing.seconds
    return drawn_part(np.array(drawing.points), share) if 0.0 <= share <= 1.0 else None
