# pyright: standard
"""The steps that every built-in room is built by: its light, its pictures, its printed codes."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from scenes.frames import look_at
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.quad import QrCode
from scenes.samples import decor
from scenes.samples.cache import static_part
from scenes.samples.furniture import RoomSet
from scenes.samples.light import AreaLight, UnlitRoom
from scenes.samples.pictures.textures import Rgb
from scenes.samples.shapes import Picture
from scenes.samples.shell import Shell

AMBIENT = 0.6
"""Share of an object's light that comes from all around, 0..1; chosen on the rooms lab and desk."""
LEVEL = 0.97
"""Light at a room's reference point after exposure, as a factor on sRGB values, 0..1."""

WallPlace = tuple[str, float, float]
"""A wall ("+x", "-x", "+y", "-y"), the coordinate along it and the height, metres."""
HungPicture = tuple[str, float, float, tuple[float, float], Picture]
"""A place on a wall as `WallPlace`, width and height in metres, and the picture."""


def lit_room(
    name: str,
    unlit: Callable[[], UnlitRoom],
    objects: tuple[PhysicalObject, ...],
    *,
    inside: Shell,
    rig: NDArray[np.float64],
    towards_light: NDArray[np.float64],
) -> PhysicalRoom:
    """The room under its traced light.

    Args:
        name: of the room.
        unlit: makes what never moves, before there is light.
        objects: what can be moved.
        inside: the inside of the walls.
        rig: (3,) where the 360° camera stands, metres; its front lens looks along +y.
        towards_light: (3,) unit vector.
    """
    static = static_part(name, unlit)
    return PhysicalRoom(
        name=name,
        static=(static.mesh,),
        objects=objects,
        solids=static.solids,
        light_direction=towards_light,
        world_from_rig=look_at(rig, rig + np.array([0.0, 1.0, 0.0])),
        ambient=AMBIENT,
        codes=static.codes,
        footprint_m=np.stack([inside.low[:2], inside.high[:2]]),
    )


def unlit_room(
    name: str,
    room: RoomSet,
    *,
    codes: tuple[QrCode, ...],
    lights: Iterable[AreaLight],
    reference: NDArray[np.float64],
) -> UnlitRoom:
    """Return the room's parts as one, ready to be lit; see `UnlitRoom` for the arguments."""
    surfaces, solids = tuple(room.surfaces), tuple(room.solids)
    return UnlitRoom(name, surfaces, solids, codes, tuple(lights), reference, LEVEL)


def hang_pictures(
    room: RoomSet, inside: Shell, pictures: Iterable[HungPicture], *, edge: Rgb, frame_m: float
) -> None:
    """Framed pictures on the walls; `frame_m` is the frame's width in metres."""
    for side, along, z, size, picture in pictures:
        wall = inside.wall(side, along, z)
        room.add(*decor.board(wall, size, picture, edge=edge, frame_m=frame_m))


def hang_codes(
    room: RoomSet, inside: Shell, name: str, places: Iterable[WallPlace], *, side_m: float
) -> tuple[QrCode, ...]:
    """Printed codes on the walls, numbered from 1; `side_m` is the symbol's side in metres."""
    codes = []
    for number, (side, along, z) in enumerate(places, start=1):
        card, code = decor.code(inside.wall(side, along, z), f"nexus:{name}:{number}", side_m)
        room.add(*card)
        codes.append(code)
    return tuple(codes)
