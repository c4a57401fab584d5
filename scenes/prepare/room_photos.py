"""The photos that a prepared room was made of: they stay in its work folder, not in its package."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from scenes.package import ScenePackage
from scenes.prepare.pipeline import POINTS_FOLDER, TRAINING
from scenes.prepare.reconstruction import Reconstruction, View, load_reconstruction

STRETCHED = "scale per axis"
"""Stage of a room whose axes were stretched apart, which its photos were not."""


def photos_of(package: ScenePackage, work_folder: Path, *, wanted: str) -> Reconstruction:
    """The photos that a package was made of, in its metric world.

    Args:
        package: a prepared room.
        work_folder: of its preparation.
        wanted: what they are needed for and what to do without, for the message.

    Raises:
        ValueError: the folder holds no preparation of this room.
    """
    points = work_folder / "outdoor points" / POINTS_FOLDER
    if not points.is_dir() or not (work_folder / TRAINING).is_dir():
        raise ValueError(
            f"{work_folder}: no finished preparation of {package.name!r}; to {wanted}, or name its "
            "work folder with --work"
        )
    if any(stage.name == STRETCHED for stage in package.stages):
        raise ValueError(
            f"scene {package.name!r} was stretched per axis, which its photos were not; to "
            f"{wanted}, without --per-axis"
        )
    metric = load_reconstruction(points)
    if {view.name for view in metric.views} != {view.name for view in package.views}:
        raise ValueError(
            f"{work_folder}: a preparation of other photos than those of {package.name!r}; name "
            "its own work folder with --work"
        )
    return metric


def views_of(package: ScenePackage, work_folder: Path, *, wanted: str) -> tuple[View, ...]:
    """The same photos where the package has them, should its scale have been changed since.

    Args:
        package: a prepared room.
        work_folder: of its preparation.
        wanted: see `photos_of`.

    Raises:
        ValueError: as `photos_of`.
    """
    poses = {view.name: view.world_from_camera for view in package.views}
    found = photos_of(package, work_folder, wanted=wanted).views
    return tuple(replace(view, world_from_camera=poses[view.name]) for view in found)
