"""Standpoints for the photos that would show most of what nobody saw of an object.

Places are tried on free floor all around it, at heights that a hand can hold a camera at. A place
counts by the area of the unseen cells of the object's box that it shows with what stands in the
room. The best is taken, then the best for the rest, and so on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.coverage.directions import unpacked
from scenes.coverage.record import Coverage
from scenes.coverage.sides import BOTTOM, BoxCells, box_cells
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.prepare.cutout.coverage.visibility import grey_scene, in_view, shown_cells
from scenes.prepare.cutout.object.free_place import CELL_M, floor_clearance_m
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Renderer
from scenes.state import ObjectModel

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

PHOTOS = 3
"""Photos that are asked for at a time: more is a walk around the object."""

AWAY_M = (1.0, 1.5, 0.6, 2.2)
"""Level distances from the object's box at which a place is tried, metres, the first preferred: a
phone held upright shows one and a half metres from one metre away."""

HEIGHTS_M = (1.4, 0.8, 0.3, 1.9)
"""Heights of the camera over the floor, metres, the first preferred: before the chest, kneeling,
near the floor, with the arm raised."""

BEARINGS = 24
"""Ways from the object that are tried, evenly around it: 15 degrees, half a step of a walk."""

BODY_M = 0.25
"""Free floor around whoever stands there, metres: half of a person's width, as shoulders are."""

PERSON_M = 1.7
"""Height that has to be free over it, metres."""

MIN_FACING = 0.5
"""Cosine between a cell's normal and the way to the camera from which on a photo shows it well."""

MIN_GAIN = 0.02
"""Share of the box's surface, its underside left out, below which one more photo is not worth
taking: a cell or two of most objects."""

SIDE_PX = 96
"""Side of the pictures in which it is found out what hides what: a cell is three pixels wide."""

FIELD_RAD = math.radians(60.0)
"""Least angle of those pictures: about what a phone shows across."""


@dataclass(frozen=True, slots=True)
class Standpoint:
    """A place for one more photo.

    Attributes:
        eye_m: (x, y, z) of the camera in the world, metres.
        bearing_rad: way from the object to it about up, in the object's frame: 0 along its x axis.
        away_m: level distance from the object's box.
        height_m: of the camera over the floor.
        gain: 0..1, share of the box's surface, its underside left out, that it shows and nobody saw
            and none of the standpoints before.
    """

    eye_m: tuple[float, float, float]
    bearing_rad: float
    away_m: float
    height_m: float
    gain: float


@dataclass(frozen=True, slots=True)
class Advice:
    """Photos that would help, and the share that none could show.

    Attributes:
        standpoints: the best places, the first before all.
        unseen: 0..1, share of the box's surface, its underside left out, that nobody saw.
        left: 0..1, the share that stays unseen after those photos.
        min_gain: the share below which nothing is worth a photo.
    """

    standpoints: tuple[Standpoint, ...]
    unseen: float
    left: float
    min_gain: float = MIN_GAIN


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """A place, and (6, 64) the cells that face it."""

    standpoint: Standpoint
    facing: BoolArray


def advice_for(
    package: ScenePackage,
    item: ObjectModel,
    *,
    coverage: Coverage,
    renderer: NativeRenderer,
    most: int = PHOTOS,
) -> Advice:
    """The places for photos of what nobody saw of an object, and how much they would leave.

    Args:
        package: the room with all that stands in it.
        item: one of its objects.
        coverage: what photos saw of it.
        renderer: draws splats.
        most: places at most.
    """
    cells = box_cells(item.box_m)
    area = np.repeat(cells.areas_m2[:, None], cells.points.shape[1], axis=1)
    area[BOTTOM] = 0.0
    area /= max(float(area.sum()), 1e-12)
    missing = np.where(unpacked(coverage.sides), 0.0, area)
    unseen = float(missing.sum())
    places = list(_places(package, item, cells=cells)) if unseen >= MIN_GAIN else []
    posed = grey_scene(package.room, package.objects)
    shown: dict[int, BoolArray] = {}
    chosen: list[Standpoint] = []
    while len(chosen) < most:
        best, best_gain = -1, MIN_GAIN
        bounds = np.array([float(missing[place.facing].sum()) for place in places])
        order: list[int] = np.argsort(-bounds, kind="stable").tolist()
        for index in order:
            if bounds[index] <= best_gain + 1e-9:
                break
            if index not in shown:
                shown[index] = _shown(
                    posed, item, cells=cells, place=places[index], renderer=renderer
                )
            gain = float(missing[shown[index]].sum())
            # Of two that show the same, the one that was thought of first.
            if gain > best_gain + 1e-9 or (gain > best_gain - 1e-9 and 0 <= index < best):
                best, best_gain = index, gain
        if best < 0:
            break
        at = places[best].standpoint
        chosen.append(Standpoint(at.eye_m, at.bearing_rad, at.away_m, at.height_m, best_gain))
        missing = np.where(shown[best], 0.0, missing)
    return Advice(tuple(chosen), unseen, float(missing.sum()))


def _places(package: ScenePackage, item: ObjectModel, *, cells: BoxCells) -> Iterator[_Place]:
    """Free places around an object, the preferred distances and heights first."""
    clearance_m = floor_clearance_m(package, PERSON_M)
    low = package.footprint_m[0]
    object_from_world = item.world_from_object.inverse()
    half = 0.5 * np.array(item.box_m[:2])
    for away_m in AWAY_M:
        for turn in range(BEARINGS):
            bearing = 2.0 * math.pi * turn / BEARINGS
            ahead = np.array([math.cos(bearing), math.sin(bearing)])
            # From the middle along the bearing to the box's outline, and on.
            out = float((half / np.maximum(np.abs(ahead), 1e-9)).min())
            x, y, _ = item.world_from_object @ np.array([*((out + away_m) * ahead), 0.0])
            column, row = np.floor((np.array([x, y]) - low) / CELL_M).astype(int)
            rows, columns = clearance_m.shape
            if not (0 <= row < rows and 0 <= column < columns):
                continue
            if clearance_m[row, column] < BODY_M:
                continue
            for height_m in HEIGHTS_M:
                eye = np.array([x, y, height_m])
                facing = cells.facing(object_from_world @ eye) >= MIN_FACING
                place = (float(x), float(y), height_m)
                yield _Place(Standpoint(place, bearing, away_m, height_m, 0.0), facing)


def _shown(
    posed: Sequence[PosedSplats],
    item: ObjectModel,
    *,
    cells: BoxCells,
    place: _Place,
    renderer: Renderer,
) -> BoolArray:
    """(6, 64) the cells that a camera shows there, looking at the middle of the object."""
    eye = np.array(place.standpoint.eye_m)
    centre, radius = item.sphere()
    middle = item.world_from_object @ centre
    away = max(float(np.linalg.norm(middle - eye)), 1e-6)
    wide = 2.0 * math.asin(min(radius / away, 0.9)) * 1.1
    camera = Pinhole.from_fov(SIDE_PX, SIDE_PX, max(FIELD_RAD, min(wide, 2.6)))
    pose = look_at(eye, middle)
    drawn = renderer.render(in_view(posed, camera, world_from_camera=pose), camera, pose)
    return shown_cells(
        cells,
        item.world_from_object,
        drawn=drawn,
        camera=camera,
        world_from_camera=pose,
        min_facing=MIN_FACING,
    )
