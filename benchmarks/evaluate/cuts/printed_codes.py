"""Printed codes on the free walls of a box-shaped room that has none, as its owner hangs them."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.true_labels import triangles_of
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.rays import RayScene
from scenes.samples import decor
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.shapes import Surface
from scenes.samples.shell import Shell

FloatArray = NDArray[np.float64]

CODES = 3
"""Walls that get one: two would do, and one of them may be hidden from where people walk."""

SIDE_M = 0.24
"""Of a symbol, as in the built-in rooms."""

HEIGHTS_M = (1.3, 1.5, 1.7)
"""Of its middle: where people hang such a sheet."""

PAYLOAD = 8
"""Characters of a code: what fits the smallest symbol, whose modules are the largest."""

STEP_M = 0.1
"""Between places along a wall that are compared."""

CLEAR_M = 0.4
"""Side of the square of bare wall around a code: the sheet with its quiet zone has 0.33 m."""

BEFORE_M = 0.5
"""Nothing stands nearer before it than this."""

EVEN_M = 2e-3
"""A wall is bare where it is even to this; a picture's frame stands out by 2 cm."""

EYES_M = 0.5
"""Pitch of the places at a phone's height from which a code should be seen."""

EYE_HEIGHT_M, FROM_WALL_M = 1.5, 0.5
"""Height of those places, and how far they keep from the walls."""

READABLE_M, READABLE_TURN = (0.8, 3.6), 0.6
"""Distances, and least cosine of the view's angle, at which a phone reads a symbol of that side."""


def with_codes(room: PhysicalRoom) -> PhysicalRoom:
    """The room with codes on up to three walls, each where most of the floor sees it.

    Nothing is drawn at random: a room gets the same sheets each time.

    Args:
        room: inside four walls along x and y; its floor is z = 0.

    Raises:
        ValueError: no wall has a free place.
    """
    scene = RayScene(triangles_of(room))
    height = max(float(mesh.vertices[:, 2].max()) for mesh in room.static)
    inside = Shell(np.append(room.footprint_m[0], 0.0), np.append(room.footprint_m[1], height))
    best = [_best(inside, side, scene=scene) for side in ("+x", "-x", "+y", "-y")]
    found = sorted((place for place in best if place is not None), key=lambda place: -place[0])
    if not found:
        raise ValueError(
            f"room {room.name!r}: no wall has {CLEAR_M} m × {CLEAR_M} m free for a printed code"
        )
    surfaces: list[Surface] = []
    codes: list[QrCode] = []
    for number, (_, world_from_wall) in enumerate(found[:CODES], start=1):
        card, code = decor.code(world_from_wall, _payload(room.name, number), SIDE_M)
        surfaces += [_lit(surface, room, world_from_wall=world_from_wall) for surface in card]
        codes.append(code)
    mesh = mesh_from_surfaces(surfaces)
    return replace(room, static=(*room.static, mesh), codes=(*room.codes, *codes))


def _best(inside: Shell, side: str, *, scene: RayScene) -> tuple[int, Pose] | None:
    """How many eyes see the best free place of a wall, and its frame; None if none is free."""
    axis = 1 if "x" in side else 0
    low, high = inside.low[axis] + CLEAR_M, inside.high[axis] - CLEAR_M
    best: tuple[int, Pose] | None = None
    for along in np.arange(low, high, STEP_M):
        for z in HEIGHTS_M:
            wall = inside.wall(side, float(along), z)
            if not _is_bare(wall, scene):
                continue
            seen = _eyes_that_see(wall, inside, scene=scene)
            if seen and (best is None or seen > best[0]):
                best = seen, wall
    return best


def _payload(name: str, number: int) -> str:
    """Eight characters that differ from the first on from those of the room's other codes.

    Symbols of payloads with a common beginning share most of their modules. On walls that
    show little else, structure from motion took one for another and turned photos by half a turn.
    """
    return hashlib.sha256(f"{name}:{number}".encode()).hexdigest()[:PAYLOAD].upper()


def _is_bare(world_from_wall: Pose, scene: RayScene) -> bool:
    """Whether nothing but the wall itself lies within the square, and nothing stands before it."""
    steps = np.linspace(-0.5, 0.5, 9) * CLEAR_M
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps))
    origins = world_from_wall @ np.stack([x, y, np.full(len(x), BEFORE_M)], axis=1)
    towards = np.broadcast_to(-world_from_wall.rotation[:, 2], origins.shape)
    return bool((np.abs(scene.cast(origins, towards).distance - BEFORE_M) < EVEN_M).all())


def _eyes_that_see(world_from_wall: Pose, inside: Shell, *, scene: RayScene) -> int:
    """From how many places of the floor a code here could be read."""
    low, high = inside.low[:2] + FROM_WALL_M, inside.high[:2] - FROM_WALL_M
    x, y = np.meshgrid(*(np.arange(a, b, EYES_M) for a, b in zip(low, high, strict=True)))
    eyes = np.stack([x.ravel(), y.ravel(), np.full(x.size, EYE_HEIGHT_M)], axis=1)
    towards = world_from_wall.translation - eyes
    distance = np.linalg.norm(towards, axis=1)
    turn = -towards @ world_from_wall.rotation[:, 2] / distance
    near = (distance > READABLE_M[0]) & (distance < READABLE_M[1]) & (turn > READABLE_TURN)
    return int((near & ~scene.blocked(eyes, 0.98 * towards)).sum())


def _lit(surface: Surface, room: PhysicalRoom, *, world_from_wall: Pose) -> Surface:
    """A sheet's face in the light that an object would have there."""
    facing = max(float(world_from_wall.rotation[:, 2] @ room.light_direction), 0.0)
    light = min(room.ambient + room.key * facing, 1.0)
    return replace(surface, picture=np.rint(light * surface.picture).astype(np.uint8))
