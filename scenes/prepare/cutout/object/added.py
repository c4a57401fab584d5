"""Adds an object that was captured later to a room, as a cut that takes nothing out of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.cut import Cut
from scenes.package import ScenePackage
from scenes.package.records import Stage
from scenes.pose import Pose
from scenes.state import ObjectModel

ADDED = "add"
"""Prefix of the stage of an object that came from elsewhere."""


def add_object(
    package: ScenePackage, item: ObjectModel, world_from_object: Pose, *, detail: str
) -> ScenePackage:
    """The package with an object more; `undo_cut` takes it away again, and the room never changes.

    Args:
        package: the scene; it is left as it is.
        item: the object, splats in its own frame; its pose is not heeded.
        world_from_object: where it stands now, its origin on what supports it.
        detail: where it comes from, for the scene's history.

    Raises:
        ValueError: its id is taken or unfit for a file name.
    """
    require_free_id(package, item.object_id)
    placed = replace(
        item,
        world_from_object=world_from_object,
        support_z_m=float(world_from_object.translation[2]),
    )
    nothing = np.zeros(0, dtype=np.uint32)
    cut = Cut(item.object_id, nothing, package.room.select(nothing), nothing.astype(np.bool_), 0)
    return replace(
        package,
        objects=(*package.objects, placed),
        cuts=(*package.cuts, cut),
        stages=(*package.stages, Stage(f"{ADDED} {item.object_id}", detail)),
    )


def require_free_id(package: ScenePackage, object_id: str) -> None:
    """Refuse the id of an object that is there already.

    Raises:
        ValueError: says so.
    """
    if any(item.object_id.lower() == object_id.lower() for item in package.objects):
        raise ValueError(
            f"scene {package.name!r} already has an object {object_id!r}; choose another id"
        )
