"""The mesh that objects collide with, as stages: of the splats, and a headset's laid on it."""

from __future__ import annotations

import math
from pathlib import Path

from scenes.cameras import Pinhole
from scenes.formats.mesh_glb import read_mesh, write_mesh
from scenes.formats.storage.atomic import write_file
from scenes.mesh import CollisionMesh
from scenes.prepare.collision import mesh_of_splats
from scenes.prepare.headset_mesh import place_mesh
from scenes.prepare.options import PrepareOptions
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.stages import WorkFolder, stamps
from scenes.prepare.train.trainer import TrainingResult
from scenes.render.native import NativeRenderer

COLLISION_VIEWS = 60
"""Views that depth is drawn from, evenly out of all."""
COLLISION_FILE, REGISTRATION_FILE = "room.glb", "registration.txt"


def collision_mesh(
    training: TrainingResult,
    metric: Reconstruction,
    work: WorkFolder,
    options: PrepareOptions,
    renderer: NativeRenderer,
) -> CollisionMesh | None:
    """The splats' own surface, or a headset's mesh laid on it.

    Args:
        training: the room's splats.
        metric: the photos from which the surface is seen.
        work: keeps both.
        options: names the headset's mesh, if there is one.
        renderer: draws depth.

    Returns:
        None if the splats show no surface that views agree about.

    Raises:
        ValueError: the headset's mesh is not one of this room.
        FormatError: its file is damaged.
        OSError, Cancelled: as the stages.
    """
    views = [
        (view.camera, view.world_from_camera)
        for view in metric.views
        if isinstance(view.camera, Pinhole)
    ]
    chosen = views[:: max(1, math.ceil(len(views) / COLLISION_VIEWS))]

    def of_splats(folder: Path, progress: Progress) -> CollisionMesh | None:
        try:
            mesh = mesh_of_splats(training.cloud, chosen, renderer=renderer, progress=progress)
        except ValueError:
            # A room without a hidden mesh can be walked in all the same, so it is not refused.
            return None
        write_mesh(folder / COLLISION_FILE, mesh)
        return mesh

    def load(folder: Path, progress: Progress) -> CollisionMesh | None:
        del progress
        path = folder / COLLISION_FILE
        return read_mesh(path) if path.is_file() else None

    surface = work.run(
        "collision",
        {},
        make=of_splats,
        load=load,
        detail=lambda mesh: (
            "none: the splats show no surface that views agree about"
            if mesh is None
            else f"{len(mesh.faces):,} triangles"
        ),
    )
    if options.headset_mesh is None:
        return surface
    return _headset_mesh(options.headset_mesh, surface, work)


def _headset_mesh(file: Path, surface: CollisionMesh | None, work: WorkFolder) -> CollisionMesh:
    def make(folder: Path, progress: Progress) -> tuple[CollisionMesh, str]:
        if surface is None:
            raise ValueError(
                f"{file}: cannot be laid on the room, whose splats show no surface; train longer "
                "or go without the mesh"
            )
        mesh, registration = place_mesh(read_mesh(file), surface, progress=progress)
        write_mesh(folder / COLLISION_FILE, mesh)
        write_file(folder / REGISTRATION_FILE, [registration.summary().encode()])
        return mesh, registration.summary()

    def load(folder: Path, progress: Progress) -> tuple[CollisionMesh, str]:
        del progress
        words = (folder / REGISTRATION_FILE).read_text(encoding="utf-8")
        return read_mesh(folder / COLLISION_FILE), words

    mesh, _ = work.run(
        "headset mesh",
        {"file": stamps(file)},
        make=make,
        load=load,
        detail=lambda result: f"{len(result[0].faces):,} triangles of {file.name}, {result[1]}",
    )
    return mesh
