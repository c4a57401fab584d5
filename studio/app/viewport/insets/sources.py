"""Sources of small pictures, and the poses of their eyes."""

from __future__ import annotations

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import SceneState
from studio.app.model.documents.document import Document, shown_pose
from studio.app.model.names import CAMERA
from studio.app.viewport.viewer import object_eyes

PLAIN_HEIGHT_M = 0.2
"""Of what has no box, metres: its view is taken somewhat above its origin."""


def eyes_of(
    source: str, state: SceneState, document: Document, scene: ScenePackage | None
) -> Pose | None:
    """`world_from_camera` (OpenCV axes) of somebody's eyes; None where they are not there now.

    A person's are those of their head: between the eyes, along the face. A placed camera's are its
    own. An object looks ahead along its +x from above its top.

    Args:
        source: id of a person, a placed camera, an object, body or mesh.
        state: who and what is where.
        document: with what was put into the twin.
        scene: that is open, or None.
    """
    avatar = state.avatars.get(source)
    if avatar is not None:
        return avatar.world_from_head
    twin = document.twin
    if source in twin.cameras:
        return twin.cameras[source]
    if source in twin.primitives:
        body = twin.primitives[source]
        place = shown_pose(state, source, body.world_from_primitive)
        return object_eyes(place, body.size_m[2])
    if source in twin.meshes:
        mesh = twin.meshes[source]
        place = shown_pose(state, source, mesh.world_from_mesh)
        return object_eyes(place, mesh.size_m[2])
    scanned = {} if scene is None else {item.object_id: item for item in scene.objects}
    height = scanned[source].box_m[2] if source in scanned else PLAIN_HEIGHT_M
    tracked = state.objects.get(source)
    if tracked is not None:
        return object_eyes(tracked.world_from_object, height)
    return object_eyes(scanned[source].world_from_object, height) if source in scanned else None


def sources_of(
    state: SceneState, document: Document, scene: ScenePackage | None
) -> tuple[str, ...]:
    """Ids of all whose view can be shown: the 360° camera, people, placed cameras, objects."""
    twin = document.twin
    objects = () if scene is None else tuple(item.object_id for item in scene.objects)
    found = (CAMERA, *state.avatars, *twin.cameras, *objects, *twin.primitives, *twin.meshes)
    return tuple(dict.fromkeys(found))


def title_of(source: str, name: str) -> str:
    """Return the title of a small picture of what something sees that is called so."""
    return f"{name}, front lens" if source == CAMERA else f"what {name} sees"
