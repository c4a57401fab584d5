"""The one prior of where an object is: where it stood, elsewhere on a support plane, out of sight.

Log odds are against "nowhere in view": hidden, outside the lens or carried off, of which the
picture says nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from scenes.pose import Pose
from tracking.evidence.evidence import Scene
from tracking.hypotheses.hypothesis import apart
from tracking.model.object_model import TrackModel
from tracking.model.support_planes import CELL_M, EVERYWHERE_M

STAYED = 0.9
"""Probability that an object still stands where the scan or the last session had it: people touch
at most two objects of a session's ten to twenty (paper, section 8)."""

MOVED = 0.08
"""Probability that it stands elsewhere in view: of what people touch, most stays in the room."""

UNSEEN = 1.0 - STAYED - MOVED
"""Probability that it is nowhere in view."""

SESSION = 1.0
"""Objects that weigh as much as `STAYED` in the share of what stays in a session. One, as
sessions differ by more than by chance: in most nobody has touched anything, after a party
everything stands elsewhere. With four the log odds of a place differ by 0.3 where half of ten
others have left theirs, and by 1.2 where none has."""

LIKE_BEFORE = 0.9
"""Probability that what was moved stands on the floor if it stood there before, and on furniture if
it stood on furniture. In random rooms 100 to 113, 304 of 328 moved objects did."""

MOVED_M = 5.0
"""Distance in m over which the log prior of having been moved falls by one: a room's size. Decides
between identical twins alone."""


def stayed_log_prior(*, stayed: int = 0, left: int = 0) -> float:
    """Log odds that an object stands where it stood before the session.

    How much was moved differs from session to session, so that the other objects tell: the share of
    what stays is Beta distributed, with the mean `STAYED` and the weight of `SESSION` objects.

    Args:
        stayed: other objects that are seen where they stood.
        left: other objects that are seen elsewhere, or whose place is empty.
    """
    stays = SESSION * STAYED + stayed
    leaves = SESSION * (1.0 - STAYED) + left
    return math.log(stays / leaves) + math.log((1.0 - STAYED) / UNSEEN)


def moved_log_prior(
    scene: Scene,
    model: TrackModel,
    heights_m: Sequence[float],
    *,
    world_from_last: Pose,
    world_from_now: Pose,
) -> float:
    """Log odds of one pose elsewhere.

    The probability of having been moved is shared by all places that can be distinguished, those
    of the floor and those on furniture apart.

    Args:
        scene: the frame.
        model: the object.
        heights_m: of the planes it may stand on.
        world_from_last: where it was.
        world_from_now: the pose.
    """
    is_low = float(world_from_now.translation[2]) < EVERYWHERE_M
    was_low = model.source.support_z_m < EVERYWHERE_M
    here = [height for height in heights_m if (height < EVERYWHERE_M) is is_low]
    share = LIKE_BEFORE if is_low is was_low else 1.0 - LIKE_BEFORE
    if len(here) in (0, len(heights_m)):  # it has no choice, or is held in the air
        here, share = list(heights_m), 1.0
    count = distinguishable_places(scene, model, here)
    return (
        math.log(MOVED * share / UNSEEN / count) - apart(world_from_last, world_from_now) / MOVED_M
    )


def distinguishable_places(scene: Scene, model: TrackModel, heights_m: Sequence[float]) -> float:
    """Number of places on support planes, each as wide as the object.

    Poses that share pixels are no independent trials: their likelihoods rise and fall together. In
    foreign rooms the likeliest wrong pose had 2 to 4 nats, the logarithm of this number.
    """
    planes = scene.support_planes
    low, high = scene.bounds_m[:, :2]
    width_m, depth_m = (high - low).tolist()
    floor_m2 = width_m * depth_m if np.isfinite([low, high]).all() else 1.0
    area_m2 = 0.0
    for height in heights_m:
        level = int(np.abs(np.array(planes.heights_m) - height).argmin())
        is_floor = height < EVERYWHERE_M
        area_m2 += floor_m2 if is_floor else CELL_M**2 * float(planes.maps[level].sum())
    return max(area_m2 / (2.0 * model.radius_m) ** 2, 1.0)
