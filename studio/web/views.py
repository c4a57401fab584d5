"""Viewpoints of the viewer: a free corner of the room, and from above without the ceiling."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.package import ScenePackage
from scenes.pose import Pose
from studio.view.twin import ABOVE_M, CUT_M

EYE_HEIGHT_M = 1.8
"""Of the view from the corner: a standing person's, a little more."""

INSET = 0.14
"""Share of the floor's sides by which the corner's eye stands inside, chosen."""

LOOK_HEIGHT_M = 0.7
"""Height that is looked at: of seats and tables."""

ELBOW_ROOM_M = 0.5
"""Splats nearer to an eye than this stand in its way."""

MARGIN_M = 0.7
"""Around the floor in the view from above, chosen: room for the walls, which lean outwards."""

FIELD_OF_VIEW_DEG = 62.0
"""Of the viewer's camera, top to bottom, as in its room.js."""


def views_of(scene: ScenePackage, places: list[NDArray[np.float64]]) -> dict[str, Any]:
    """The views by name, as the page reads them: eye, target, and what is cut off before the eye.

    Args:
        scene: the room.
        places: (3,) of what should be seen, metres; may be empty.
    """
    low, high = scene.footprint_m
    middle = 0.5 * (low + high)
    seen = np.mean(np.array(places), axis=0)[:2] if places else middle
    target = [*(0.5 * (seen + middle)), LOOK_HEIGHT_M]
    eyes = [
        np.array([x, y, EYE_HEIGHT_M])
        for x in (low[0] + INSET * (high - low)[0], high[0] - INSET * (high - low)[0])
        for y in (low[1] + INSET * (high - low)[1], high[1] - INSET * (high - low)[1])
    ]
    eye = min(eyes, key=lambda e: (_in_the_way(scene, e), -float(np.linalg.norm(e[:2] - seen))))
    # As far up as the whole floor needs; what is higher than CUT_M is cut off.
    half = 0.5 * float((high - low).max()) + MARGIN_M
    up = min(CUT_M + half / math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2), ABOVE_M)
    # A centimetre off the vertical: straight down, which way is up would be undefined.
    above = [float(middle[0]), float(middle[1]) - 0.01, up]
    return {
        "corner": {"eye": _rounded(eye), "target": _rounded(target)},
        "above": {
            "eye": _rounded(above),
            "target": _rounded([*middle, 0.0]),
            "near": round(up - CUT_M, 3),
        },
    }


def first_places(
    scene: ScenePackage, moved: set[str], world_from_object: dict[str, Pose]
) -> list[NDArray[np.float64]]:
    """Return the last places of the objects that move; of all objects where none moved."""
    chosen = [o for o in scene.objects if o.object_id in moved] or list(scene.objects)
    return [world_from_object.get(o.object_id, o.world_from_object).translation for o in chosen]


def _in_the_way(scene: ScenePackage, eye: NDArray[np.float64]) -> int:
    """Splats around an eye, in hundreds: a few do not matter."""
    near = np.linalg.norm(scene.room.means - eye.astype(np.float32), axis=1) < ELBOW_ROOM_M
    return int(near.sum()) // 100


def _rounded(values: Any) -> list[float]:
    return [round(float(value), 4) for value in values]
