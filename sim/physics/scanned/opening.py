"""The physics of a room that was scanned: from its package, or from its physical room."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from scenes.mesh import PhysicalRoom
from scenes.package import ScenePackage
from sim.physics.moving.people import PersonTarget
from sim.physics.scanned.objects import scanned_object
from sim.physics.scanned.surface import scanned_surface
from sim.physics.scanned.twin import Twin


def twin_of_package(scene: ScenePackage, *, tracked: Collection[str] = ()) -> Twin:
    """The physics of a prepared room.

    Args:
        scene: with a collision mesh.
        tracked: ids of objects that a tracker moves; the others are free.

    Raises:
        ValueError: nobody has measured what objects collide with, or it is no room.
    """
    if scene.collision is None:
        raise ValueError(f"scene {scene.name!r} has no collision mesh; prepare it with one")
    movables = tuple(scanned_object(item) for item in scene.objects)
    ready = scanned_surface(scene.collision, movables, name=scene.name)
    return Twin(ready.surface, ready.movables, tracked=tracked, notes=ready.notes)


def twin_of_room(room: PhysicalRoom, people: Mapping[str, PersonTarget]) -> Twin:
    """The physics of a scanned room that is rehearsed in, with people.

    Args:
        room: with a collision mesh.
        people: where each starts, by person id.

    Raises:
        ValueError: it has none, or it is no room.
    """
    if room.collision is None:
        raise ValueError(f"room {room.name!r} has no collision mesh; prepare it with one")
    ready = scanned_surface(room.collision, room.objects, name=room.name)
    twin = Twin(ready.surface, ready.movables, people=people, notes=ready.notes)
    twin.part_overlaps()
    return twin
