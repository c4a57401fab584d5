"""A splat file of elsewhere as a scene that people can walk in and objects collide with."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scenes.formats.registry import is_in_world_frame, read_splats
from scenes.harmonics import turned
from scenes.package import ScenePackage, Stage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.collision import mesh_of_splats
from scenes.prepare.foreign.free_space import find_free_space, rig_at, views_from
from scenes.prepare.foreign.level import Up, find_level, upright
from scenes.prepare.progress import Progress, silent
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FILE_UP: Up = "-y"
"""Of splat files as this program reads them: x right, y down, z forward."""

LOWEST_ROOM_M, HIGHEST_ROOM_M = 1.8, 12.0
"""Heights from floor to ceiling that a unit may give, metres: a cellar's and a hall's."""


@dataclass(frozen=True, slots=True)
class Unit:
    """How long a file's unit is; one of the two, or neither where the file says metres itself.

    Attributes:
        metres_per_unit: metres of one unit.
        height_m: metres from the room's floor to its ceiling.

    Raises:
        ValueError: both, or a value that is not positive.
    """

    metres_per_unit: float | None = None
    height_m: float | None = None

    def __post_init__(self) -> None:
        given = [v for v in (self.metres_per_unit, self.height_m) if v is not None]
        if len(given) == 2:
            raise ValueError("--metres-per-unit and --height: say one of the two")
        if given and not (np.isfinite(given[0]) and given[0] > 0):
            raise ValueError(f"the unit: {given[0]}, wanted a length > 0")
        height_m = self.height_m
        if height_m is not None and not LOWEST_ROOM_M <= height_m <= HIGHEST_ROOM_M:
            raise ValueError(
                f"--height {height_m:g} m from floor to ceiling, limits {LOWEST_ROOM_M:g} to "
                f"{HIGHEST_ROOM_M:g} m; without a ceiling, say --metres-per-unit"
            )


def foreign_scene(
    path: Path,
    *,
    unit: Unit = Unit(),
    up: Up | None = None,
    renderer: NativeRenderer,
    progress: Progress = silent,
) -> ScenePackage:
    """A scene of a splat file as `upright_scene` makes it, with a collision mesh.

    Its stages say in words how up was found and what is not known of it.

    Args:
        path: a splat file of any format.
        unit: how long its unit is.
        up: which axis of the file is up; None to look for it.
        renderer: draws depth.
        progress: called with the share done.

    Raises:
        FormatError: the file is damaged.
        ValueError: nobody says how long its unit is, or it shows no room; one line.
    """
    package, ceiling_m = upright_scene(path, unit=unit, up=up)
    return with_collision(package, ceiling_m=ceiling_m, renderer=renderer, progress=progress)


def upright_scene(
    path: Path, *, unit: Unit = Unit(), up: Up | None = None
) -> tuple[ScenePackage, float]:
    """A scene of a splat file, upright, in metres, its floor at z = 0; and its ceiling's height.

    Args:
        path: a splat file of any format.
        unit: how long its unit is.
        up: which axis of the file is up; None to look for it.

    Raises:
        FormatError: the file is damaged.
        ValueError: nobody says how long its unit is, or it has no opaque splat; one line.
    """
    left_out: list[str] = []
    cloud = read_splats(path, on_bad=left_out.append)
    in_world = is_in_world_frame(path)
    level = find_level(cloud, convention="z" if in_world else FILE_UP, up=up)
    height = level.ceiling - level.floor
    metres = _metres_per_unit(path, unit, height, known=in_world)
    room = _scale(turned(cloud, upright(level)), metres)
    floor = (
        f"the highest level surface is {metres * height:.2f} m above the floor"
        if level.found
        else "no level floor was found: the lowest hundredth is taken for it"
    )
    package = ScenePackage(
        name=path.name,
        room=room,
        objects=(),
        codes=(),
        world_from_rig=Pose.identity(),
        footprint_m=np.zeros((2, 2)),
        physical=None,
        stages=(
            Stage("open", "; ".join([f"splat file {path.name}, {metres:g} m per unit", *left_out])),
            Stage("upright", f"{level.evidence}; {floor}"),
        ),
    )
    return package, metres * height


def with_collision(
    package: ScenePackage,
    *,
    ceiling_m: float,
    renderer: NativeRenderer,
    progress: Progress = silent,
) -> ScenePackage:
    """The package with a collision mesh from its splats' depth, seen from places that are free.

    Views, the camera's stand and the footprint are those found on the way.

    Args:
        package: its room is in metres with the floor at z = 0.
        ceiling_m: height of the ceiling over the floor; below a room's, there is none.
        renderer: draws depth.
        progress: called after every view.

    Raises:
        ValueError: there is no free place, or the splats show no surface.
    """
    if ceiling_m < LOWEST_ROOM_M:
        ceiling_m = math.inf
    try:
        space = find_free_space(package.room, ceiling_m=ceiling_m)
        views = views_from(space.places_m)
        mesh = mesh_of_splats(package.room, views, renderer=renderer, progress=progress)
    except ValueError as error:
        raise ValueError(f"{package.name}: {error}") from None
    points = tuple(
        ViewPoint(f"view-{number:03d}", camera, pose) for number, (camera, pose) in enumerate(views)
    )
    note = f"{len(mesh.faces)} triangles from {len(views)} views at {len(space.places_m)} places"
    return replace(
        package,
        world_from_rig=rig_at(space.stand_m),
        footprint_m=space.footprint_m,
        views=points,
        collision=mesh,
        stages=(*package.stages, Stage("collision", note)),
    )


def no_movable_object(name: str) -> str:
    """Warning about a scene in which only people can move."""
    if name.endswith(".gnx"):
        return f"{name} has no movable object, so only people walk; 'nexus cut {name} --propose'"
    package = f"{Path(name).name.split('.')[0] or 'room'}.gnx"
    return (
        f"{name} has no movable object, so only people walk; cut one out with "
        f"'nexus convert {name} {package}', then 'nexus cut {package} --propose'"
    )


def _metres_per_unit(path: Path, unit: Unit, height: float, *, known: bool) -> float:
    if unit.metres_per_unit is not None:
        metres = unit.metres_per_unit
    elif unit.height_m is not None:
        metres = unit.height_m / max(height, 1e-9)
    elif known:
        metres = 1.0
    else:
        raise ValueError(
            f"{path}: states no unit: say --metres-per-unit N, or --height M from the room's floor "
            f"to its ceiling ({height:.3g} units)"
        )
    return metres


def _scale(cloud: SplatCloud, metres: float) -> SplatCloud:
    return replace(cloud, means=cloud.means * metres, scales=cloud.scales * metres)
