"""Where items are put by hand: one step of undo, and the line of a script that does the same."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from studio.app.model.documents.document import with_item
from studio.app.model.workbench import Workbench
from studio.app.viewport.by_hand.items import pose_of


def move_item(bench: Workbench, item_id: str, world_from_item: Pose, *, merge: str = "") -> None:
    """Put an object, body or camera somewhere, as one step of undo per `merge`.

    Raises:
        ValueError: nothing of that id can be moved.
    """
    twin = bench.document.twin
    if item_id in twin.primitives:
        moved = replace(twin.primitives[item_id], world_from_primitive=world_from_item)
        changed = replace(twin, primitives=with_item(twin.primitives, item_id, moved))
    elif item_id in twin.meshes:
        mesh = replace(twin.meshes[item_id], world_from_mesh=world_from_item)
        changed = replace(twin, meshes=with_item(twin.meshes, item_id, mesh))
    elif item_id in twin.cameras:
        changed = replace(twin, cameras=with_item(twin.cameras, item_id, world_from_item))
    elif pose_of(bench, item_id) is not None:
        changed = replace(twin, poses=with_item(twin.poses, item_id, world_from_item))
    else:
        raise ValueError(f"{item_id!r}: nothing of that name can be moved")
    bench.change(
        f"Move {bench.name_of(item_id)}", replace(bench.document, twin=changed), merge=merge
    )


def note_pose(bench: Workbench, item_id: str, world_from_item: Pose) -> None:
    """Write a drag down as the line of a script that does the same."""
    x, y, z = (round(float(v), 4) for v in world_from_item.translation)
    yaw = math.degrees(math.atan2(world_from_item.rotation[1, 0], world_from_item.rotation[0, 0]))
    bench.note("twin.place", item=item_id, x=x, y=y, z=z, yaw_deg=round(yaw, 2))


def places_text(places: tuple[NDArray[np.float64], ...]) -> list[list[float]]:
    """Places as numbers for a script, to the tenth of a millimetre."""
    return [[round(float(v), 4) for v in place] for place in places]
