"""A scene whose scale was wrong: all of its lengths times one factor, about the world's origin."""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes.cut import Cut
from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.mesh import BoxPart, CollisionMesh
from scenes.package import ScenePackage, Stage, load_package, save_package
from scenes.package.reality import Reality
from scenes.prepare.align.similarity import Similarity
from scenes.quad import QrCode
from scenes.state import ObjectModel


def rescale_scene(source: Path, target: Path, *, factor: float) -> ScenePackage:
    """Write a scene again with all lengths times `factor`; the one that is read stays as it is.

    Args:
        source: folder of a scene package.
        target: folder to make or replace.
        factor: true metres of what the scene has as one metre, > 0.

    Returns:
        What was written.

    Raises:
        PackageError: the source is damaged, or the target holds something else.
        ValueError: the factor is not positive and finite, the scene is a built-in room's, or both
            folders are the same; one line.
        WriteError: the disk is full or the place not writable; nothing is left behind.
    """
    if target.exists() and source.samefile(target):
        raise ValueError(f"{target}: is the scene to read; choose another name to write")
    package = load_package(source)
    with tempfile.TemporaryDirectory() as scratch:
        scaled = rescaled(package, factor=factor, scratch=Path(scratch))
        save_package(scaled, target)
    return scaled


def rescaled(package: ScenePackage, *, factor: float, scratch: Path) -> ScenePackage:
    """The scene with all lengths times `factor`; floor and origin stay where they are.

    Objects keep their shape and density, so that a guessed mass grows with the volume. Photos look
    as before: a lens knows no scale.

    Args:
        package: a scene that is no built-in room's.
        factor: true metres of what it has as one metre, > 0.
        scratch: an empty folder; a second reconstruction is written there, to be saved from.

    Raises:
        ValueError: the factor is not positive and finite, or the scene is a built-in room's.
    """
    if not (math.isfinite(factor) and factor > 0):
        raise ValueError(f"the scale: {factor}, wanted a factor > 0")
    if package.physical is not None:
        raise ValueError(f"{package.name}: is a scan of a built-in room, whose scale is exact")
    bigger = Similarity(factor, np.eye(3), np.zeros(3))
    mesh, reality = package.collision, package.reality
    return replace(
        package,
        room=bigger.moved_cloud(package.room),
        objects=tuple(_object(item, bigger) for item in package.objects),
        codes=tuple(
            QrCode(code.payload, code.side_m * factor, bigger.moved(code.world_from_code))
            for code in package.codes
        ),
        world_from_rig=bigger.moved(package.world_from_rig),
        footprint_m=package.footprint_m * factor,
        stages=(*package.stages, Stage("scale", f"all lengths times {factor:.6g}")),
        views=tuple(
            replace(view, world_from_camera=bigger.moved(view.world_from_camera))
            for view in package.views
        ),
        collision=None if mesh is None else CollisionMesh(mesh.vertices * factor, mesh.faces),
        cuts=tuple(_cut(cut, bigger) for cut in package.cuts),
        reality=None if reality is None else _reality(reality, bigger, scratch),
    )


def _cut(cut: Cut, bigger: Similarity) -> Cut:
    before = None if cut.replaced is None else bigger.moved_cloud(cut.replaced)
    return replace(cut, taken=bigger.moved_cloud(cut.taken), replaced=before)


def _object(item: ObjectModel, bigger: Similarity) -> ObjectModel:
    factor = bigger.scale
    x, y, z = (factor * side for side in item.box_m)
    mass = item.guessed_mass_kg
    return replace(
        item,
        splats=bigger.moved_cloud(item.splats),
        box_m=(x, y, z),
        support_z_m=factor * item.support_z_m,
        world_from_object=bigger.moved(item.world_from_object),
        parts=tuple(_part(part, bigger) for part in item.parts),
        guessed_mass_kg=None if mass is None else mass * factor**3,
    )


def _part(part: BoxPart, bigger: Similarity) -> BoxPart:
    x, y, z = (bigger.scale * side for side in part.half_size_m)
    return BoxPart(bigger.moved(part.object_from_box), (x, y, z))


def _reality(reality: Reality, bigger: Similarity, scratch: Path) -> Reality:
    path = scratch / reality.splats.name
    write_ply(path, bigger.moved_cloud(reality.read()), comments=[WORLD_COMMENT])
    # Of the world's seven numbers only the translation is a length.
    units = np.ones(len(reality.covariance))
    units[3:6] = bigger.scale
    return replace(
        reality,
        splats=path,
        covariance=units[:, None] * reality.covariance * units,
        centre_m=reality.centre_m * bigger.scale,
    )
