"""Items that can be selected and moved in a view, with their poses."""

from __future__ import annotations

from scenes.pose import Pose
from studio.app.model.documents.document import shown_pose
from studio.app.model.workbench import Workbench
from studio.app.twin.edits import pose_of as edited_pose
from studio.app.twin.edits import taken_ids
from studio.app.twin.items import scanned_poses
from studio.app.viewport.by_hand.picking import Boxes

CAMERA_BOX_M = (0.2, 0.2, 0.2)
PERSON_BOX_M = (0.5, 0.5, 1.8)
"""Boxes of a placed camera and of a person for picking, metres."""


def pose_of(bench: Workbench, item_id: str) -> Pose | None:
    """Pose of an item in the world, as it is shown; None if there is none of that id."""
    moving = bench.state.objects.get(item_id)
    if moving is not None:
        return moving.world_from_object
    scanned = scanned_poses(bench.scene)
    if item_id not in taken_ids(bench.document, scanned):
        return None
    return edited_pose(bench.document, scanned, item_id)


def is_held_by_hand(bench: Workbench, item_id: str) -> bool:
    """Whether hands decide where an item is, and no session or recording does."""
    if bench.is_by_hand:
        return True
    return item_id not in bench.state.objects and item_id not in scanned_poses(bench.scene)


def boxes_of(bench: Workbench) -> Boxes:
    """Base pose and extents of everything that can be picked, by id."""
    found: dict[str, tuple[Pose, tuple[float, float, float]]] = {}
    for item in () if bench.scene is None else bench.scene.objects:
        pose = pose_of(bench, item.object_id)
        assert pose is not None
        found[item.object_id] = (pose, item.box_m)
    twin = bench.document.twin
    for key, body in twin.primitives.items():
        found[key] = (shown_pose(bench.state, key, body.world_from_primitive), body.size_m)
    for key, shared in bench.state.primitives.items():
        found[key] = (shared.world_from_primitive, shared.size_m)
    for key, mesh in twin.meshes.items():
        place = shown_pose(bench.state, key, mesh.world_from_mesh)
        found[key] = (place, mesh.size_m)
    for key, world_from_camera in twin.cameras.items():
        place = world_from_camera.translation - (0.0, 0.0, 0.5 * CAMERA_BOX_M[2])
        found[key] = (Pose.from_yaw(0.0, place), CAMERA_BOX_M)
    for key, avatar in bench.state.avatars.items():
        x, y, z = (float(v) for v in avatar.world_from_head.translation)
        height = PERSON_BOX_M[2]
        found[key] = (Pose.from_yaw(0.0, (x, y, z + 0.15 - height)), PERSON_BOX_M)
    return found
