"""Furniture of a scene as solids: what people's hands stay out of."""

from __future__ import annotations

from scenes.bodies.furniture import Furniture, level_slabs, solids_of
from scenes.bodies.solids import no_solids
from scenes.package import ScenePackage
from scenes.samples import unlit_room


def furniture_of(scene: ScenePackage) -> Furniture:
    """Return it: of a built-in room its boxes, of a scanned one the level parts of its mesh."""
    parts = {item.object_id: solids_of(item.parts) for item in scene.objects if item.parts}
    places = {item.object_id: item.world_from_object for item in scene.objects}
    if scene.physical is not None:
        return Furniture(solids_of(unlit_room(scene.physical).solids), parts, places)
    fixed = no_solids() if scene.collision is None else level_slabs(scene.collision)
    return Furniture(fixed, parts, places)
