"""Furniture of random rooms that stays: tables, sofas, cabinets, shelves, and what may stand on it.

Built in a frame of its own: back at y = 0, front towards -y, x in the middle, floor at z = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.random_rooms.finishes import COLOURS, DARKS, random_wood, smooth
from benchmarks.random_rooms.movable import SEAT, TOP
from scenes.pose import Pose
from scenes.samples.decor import books_on_board, storage_box
from scenes.samples.furniture import RoomSet, shelf_unit, table
from scenes.samples.pictures.textures import mixed, plain
from scenes.samples.shapes import STATIC_CELL_M, placed, prism, rounded_outline

UNDER = "under"
"""Floor below a table top."""


@dataclass(frozen=True, slots=True)
class Stand:
    """A level rectangle that objects may stand on.

    Attributes:
        kind: `TOP`, `SEAT` or `UNDER`.
        low: lowest corner (x, y), metres.
        high: highest corner (x, y), metres.
        z: its height.
        clear_m: free height above it.
    """

    kind: str
    low: tuple[float, float]
    high: tuple[float, float]
    z: float
    clear_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Furniture:
    """A piece of furniture in its own frame.

    Attributes:
        kind: such as "sofa".
        parts: surfaces and solids.
        size_m: (width, depth, height).
        stands: what may be stood on, in its frame.
    """

    kind: str
    parts: RoomSet
    size_m: tuple[float, float, float]
    stands: tuple[Stand, ...]


Build = Callable[[np.random.Generator], Furniture]


def desk(rng: np.random.Generator) -> Furniture:
    """A table of 1 to 1.8 m."""
    size = float(rng.uniform(1.0, 1.8)), float(rng.uniform(0.6, 0.9)), float(rng.uniform(0.7, 0.77))
    return _table("desk", rng, size)


def low_table(rng: np.random.Generator) -> Furniture:
    """A coffee table."""
    size = float(rng.uniform(0.7, 1.1)), float(rng.uniform(0.5, 0.7)), float(rng.uniform(0.38, 0.5))
    return _table("low-table", rng, size)


def sofa(rng: np.random.Generator) -> Furniture:
    """A sofa for two or three."""
    cloth = smooth(rng, mixed((*COLOURS, *DARKS), rng))
    w, d = float(rng.uniform(1.5, 2.1)), float(rng.uniform(0.75, 0.92))
    seat, arm, top = float(rng.uniform(0.38, 0.45)), 0.16, float(rng.uniform(0.74, 0.9))
    room = RoomSet()
    blocks = (
        ((-w / 2 + arm, 0.02 - d, 0.08), (w / 2 - arm, -0.04, seat)),
        ((-w / 2, -0.2, 0.08), (w / 2, 0.0, top)),
        ((-w / 2, -d, 0.08), (arm - w / 2, 0.0, seat + 0.2)),
        ((w / 2 - arm, -d, 0.08), (w / 2, 0.0, seat + 0.2)),
    )
    for low, high in blocks:
        size = high[0] - low[0], high[1] - low[1]
        outline = rounded_outline(*size, radius=0.04, cell_m=STATIC_CELL_M)
        profile = [(0.03, high[2]), (0.008, high[2] - 0.01), (0.0, high[2] - 0.035), (0.0, low[2])]
        solid = prism(outline, profile, side=cloth, cell_m=STATIC_CELL_M)
        middle = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.0
        room.add(*placed(solid, Pose.from_yaw(0.0, middle)))
        room.solid((low[0], low[1], 0.0), high)
    inner = Stand(SEAT, (arm - w / 2, 0.02 - d), (w / 2 - arm, -0.22), seat, 1.0)
    return Furniture("sofa", room, (w, d, top), (inner,))


def cabinet(rng: np.random.Generator) -> Furniture:
    """A sideboard or a wardrobe with doors."""
    is_tall = rng.random() < 0.3
    w, d = float(rng.uniform(0.8, 1.6)), float(rng.uniform(0.36, 0.55))
    h = float(rng.uniform(1.7, 2.1)) if is_tall else float(rng.uniform(0.6, 0.95))
    body = random_wood(rng) if rng.random() < 0.6 else plain(mixed(COLOURS, rng))
    front = body if rng.random() < 0.5 else plain(mixed(COLOURS, rng))
    room = RoomSet()
    room.block((-w / 2, -d, 0.06), (w / 2, 0.0, h), body, faces="+x-x-y+z+y")
    room.block((-w / 2 + 0.03, -d + 0.03, 0.0), (w / 2 - 0.03, 0.0, 0.06), plain((60, 60, 62)))
    room.solid((-w / 2, -d, 0.0), (w / 2, 0.0, h))
    doors = max(2, round(w / 0.5))
    step = w / doors
    for k in range(doors):
        x = -w / 2 + k * step
        leaf = (x + 0.006, -d - 0.016, 0.08), (x + step - 0.006, -d, h - 0.02)
        room.block(*leaf, front, faces="+x-x-y+z-z")
        knob = x + (0.82 if k % 2 == 0 else 0.12) * step
        place = (knob, -d - 0.036, 0.55 * h), (knob + 0.025, -d - 0.016, 0.55 * h + 0.09)
        room.block(*place, plain((90, 92, 96)), faces="+x-x-y+z-z")
    stands = () if is_tall else (Stand(TOP, (-w / 2, -d), (w / 2, 0.0), h, 0.8),)
    return Furniture("cabinet", room, (w, d + 0.04, h), stands)


def shelf(rng: np.random.Generator) -> Furniture:
    """An open shelf with books and boxes, its top free where it is low."""
    w, d, h = float(rng.uniform(0.7, 1.2)), 0.33, float(rng.uniform(0.8, 2.0))
    count = max(3, round(h / 0.36))
    room = RoomSet()
    low, high = (-w / 2, -d, 0.0), (w / 2, 0.0, h)
    boards = shelf_unit(
        room, low, high, material=random_wood(rng), boards=count, open_side="-y"
    )  # fmt: skip
    for z in boards:
        if rng.random() < 0.7:
            end = float(rng.uniform(0.1, w / 2 - 0.04))
            books_on_board(room, -w / 2 + 0.04, end, -0.03, z, rng)
        else:
            x = float(rng.uniform(-w / 2 + 0.05, 0.0))
            corner = (x + 0.24, -0.06, z + 0.2)
            storage_box(room, (x, -0.28, z), corner, rng, mixed(COLOURS, rng))
    stands = (Stand(TOP, (-w / 2, -d), (w / 2, 0.0), h, 0.6),) if h < 1.15 else ()
    return Furniture("shelf", room, (w, d, h), stands)


FURNITURE: Mapping[str, Build] = {
    "desk": desk,
    "low-table": low_table,
    "sofa": sofa,
    "cabinet": cabinet,
    "shelf": shelf,
}


def _table(kind: str, rng: np.random.Generator, size: tuple[float, float, float]) -> Furniture:
    w, d, h = size
    room = RoomSet()
    legs = plain(mixed(DARKS, rng)) if rng.random() < 0.6 else random_wood(rng)
    top = random_wood(rng) if rng.random() < 0.7 else plain(mixed(COLOURS, rng))
    table(room, (-w / 2, -d, 0.0), (w / 2, 0.0, h), top=top, legs=legs)
    below = Stand(UNDER, (0.1 - w / 2, 0.1 - d), (w / 2 - 0.1, -0.1), 0.0, h - 0.12)
    return Furniture(kind, room, size, (Stand(TOP, (-w / 2, -d), (w / 2, 0.0), h, 0.9), below))
