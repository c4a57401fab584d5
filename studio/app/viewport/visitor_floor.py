"""Floor on which a visitor may stand in a scene: free of what never moves."""

from __future__ import annotations

from scenes.package import ScenePackage
from sim.navigation.floor import FloorMap, FreeFloor


def visitor_floor(scene: ScenePackage) -> FreeFloor:
    """The free floor of a scene; all of its footprint where nothing says what stops people."""
    from scenes.mesh import PhysicalRoom
    from scenes.samples import SAMPLE_NAMES, sample_room

    if scene.physical in SAMPLE_NAMES:
        room = sample_room(str(scene.physical))
    else:
        room = PhysicalRoom(
            name=scene.name,
            static=(),
            objects=(),
            solids=(),
            light_direction=scene.world_from_rig.rotation[:, 2],
            world_from_rig=scene.world_from_rig,
            footprint_m=scene.footprint_m,
            collision=scene.collision,
        )
    return FloorMap(room).bare
