"""Putting one object somewhere, and out of what already stands there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from sim.physics.engine import mujoco
from sim.physics.mouse_hand import free_body

TOLERATED_M = 0.002
"""Overlap that is left: what rests on noise of a scan overlaps by less than that."""
CLEARED_M = 0.0005
"""Gap that is left to what an object was pushed out of."""
PUSHES = 40
"""Pushes out of the deepest contact before the object is lifted instead: a corner needs three."""
LIFT_M = 0.02
"""Height of one lift, well below the thickness of a table's top and of an object."""
LIFTS = 150
"""Lifts before it stays where it is: 3 m, a room."""


def place_clear(object_id: str, world_from_object: Pose, *, model: Any, data: Any) -> Pose:
    """Put a free object somewhere, at rest, and push it out of what it overlaps.

    Nothing else moves and no time passes. What is squeezed from several sides is lifted out.

    Args:
        object_id: a free body.
        world_from_object: where it is wanted.
        model: of the body.
        data: of the body.

    Returns:
        Where it is now; as wanted if that is free, or if there is no way out.

    Raises:
        NotFree: there is no such free body.
    """
    body = free_body(model, object_id)
    _put(object_id, world_from_object.translation, world_from_object, data)
    place = np.array(world_from_object.translation)
    for _ in range(PUSHES):
        way = _way_out(body, model, data)
        if way is None:
            return _pose(body, data)
        place += way
        _put(object_id, place, world_from_object, data)
    place = np.array(world_from_object.translation)
    for _ in range(LIFTS):
        place[2] += LIFT_M
        _put(object_id, place, world_from_object, data)
        if _way_out(body, model, data) is None:
            return _pose(body, data)
    _put(object_id, world_from_object.translation, world_from_object, data)
    mujoco.mj_forward(model, data)
    return _pose(body, data)


def _put(object_id: str, place: NDArray[np.float64], attitude: Pose, data: Any) -> None:
    joint = data.joint(f"{object_id}:free")
    joint.qpos[:3] = place
    joint.qpos[3:] = attitude.quaternion()
    joint.qvel[:] = 0.0


def _way_out(body: int, model: Any, data: Any) -> NDArray[np.float64] | None:
    """(3,) metres out of the deepest overlap of a body; None if it has none that matters."""
    mujoco.mj_fwdPosition(model, data)
    geoms = data.contact.geom
    if not len(geoms):
        return None
    is_own = model.geom_bodyid[geoms] == body
    depth = np.where(is_own.any(axis=1), -data.contact.dist, -np.inf)
    deepest = int(np.argmax(depth))
    if depth[deepest] <= TOLERATED_M:
        return None
    # A contact's normal points from its first geom to its second.
    out = 1.0 if is_own[deepest, 1] else -1.0
    return out * (float(depth[deepest]) + CLEARED_M) * data.contact.frame[deepest, :3]


def _pose(body: int, data: Any) -> Pose:
    return Pose.from_quaternion(data.xquat[body], data.xpos[body])
