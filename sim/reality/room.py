"""A scanned room as a physical one: what stands in it, what stops it, and its light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.mesh import PhysicalRoom
from scenes.package import ScenePackage
from scenes.prepare.cutout.likewise import TakenApart
from scenes.render.renderer import Renderer
from sim.physics.scanned.objects import scanned_object
from sim.reality.light import irradiance_at, main_light

CHEST_M = 1.2
"""Height at which a room's light is asked for, metres."""


def scanned_room(scene: ScenePackage, parts: TakenApart, renderer: Renderer) -> PhysicalRoom:
    """The room that a scan was made of, as far as photos show it.

    Args:
        scene: the scan, with a collision mesh.
        parts: of another reconstruction of the same room.
        renderer: draws the room for its light.

    Raises:
        ValueError: nobody has measured what objects collide with.
    """
    if scene.collision is None:
        raise ValueError(
            f"scene {scene.name!r} has no collision mesh, so nothing would stop people and "
            "objects: its splats show no surface that photos agree about; film it again with more "
            "overlap"
        )
    objects = tuple(
        replace(scanned_object(item), splats=parts.objects.get(item.object_id))
        for item in scene.objects
    )
    middle = np.array([*scene.footprint_m.mean(axis=0), CHEST_M])
    direction, ambient, key = main_light(irradiance_at(middle, parts.room, renderer))
    return PhysicalRoom(
        name=scene.name,
        static=(),
        objects=objects,
        solids=(),
        light_direction=direction,
        world_from_rig=scene.world_from_rig,
        ambient=ambient,
        key=key,
        codes=scene.codes,
        footprint_m=scene.footprint_m,
        splats=parts.room,
        collision=scene.collision,
    )
