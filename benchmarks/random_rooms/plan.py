"""The plan of a random room: its size, what furniture stands where, what hangs on the walls."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.random_rooms.finishes import COLOURS
from benchmarks.random_rooms.furniture import FURNITURE, Furniture, Stand
from benchmarks.random_rooms.outlines import Outline, outline_of, overlaps
from scenes.mesh import BoxPart
from scenes.pose import Pose
from scenes.samples import decor
from scenes.samples.furniture import RoomSet
from scenes.samples.light import AreaLight
from scenes.samples.pictures import wall_art
from scenes.samples.pictures.textures import (
    Rgb,
    mixed,
    noise,
    parquet,
    picture,
    plain,
    plaster,
    size_px,
    tinted,
)
from scenes.samples.pictures.wall_art import rug as woven
from scenes.samples.shapes import Material, Picture, placed, quad
from scenes.samples.shell import SKIRTING_M, WALL_SOLID_M, Shell

SIDES = ("+y", "-y", "+x", "-x")

YAW = {"+y": 0.0, "-y": math.pi, "+x": -math.pi / 2, "-x": math.pi / 2}
"""Turn of a piece of furniture whose back is to a wall."""

TRIES = 40
"""Places that are tried for a piece of furniture or a picture before it is left out."""

BETWEEN_M = 0.06
"""Gap between pieces of furniture."""

BOARDS: tuple[Rgb, ...] = ((196, 158, 114), (150, 108, 72), (110, 82, 60), (214, 190, 156))

CARPETS: tuple[Rgb, ...] = ((120, 122, 126), (94, 104, 118), (158, 144, 124), (110, 84, 80))

TILES: tuple[Rgb, ...] = ((196, 192, 184), (150, 146, 140), (120, 96, 80), (88, 92, 98))

PAPERS: tuple[Rgb, ...] = (
    (228, 224, 214), (206, 214, 208), (198, 206, 218), (222, 206, 188), (170, 186, 180),
    (204, 190, 204), (236, 232, 226), (120, 140, 150),
)  # fmt: skip

RUG_SHARE = 0.45
"""Share of the rooms with a rug."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A room without movable objects.

    Attributes:
        inside: of the walls.
        parts: every surface and solid.
        stands: where objects may stand, apart from the open floor.
        furniture: outline of each piece.
        lights: what shines; the window first.
    """

    inside: Shell
    parts: RoomSet
    stands: tuple[Stand, ...]
    furniture: tuple[Outline, ...]
    lights: tuple[AreaLight, ...]


def random_plan(rng: np.random.Generator) -> Plan:
    """A room of 3.6 to 6.6 m by 3.3 to 5.4 m: window, door, furniture, pictures and lamps."""
    w, d = float(rng.uniform(3.6, 6.6)), float(rng.uniform(3.3, 5.4))
    half = np.array([w / 2, d / 2])
    inside = Shell(np.array([*-half, 0.0]), np.array([*half, float(rng.uniform(2.4, 3.0))]))
    room = RoomSet()
    _shell(room, inside, rng)
    window_side, door_side = (SIDES[int(k)] for k in rng.permutation(4)[:2])
    lights, kept_free = _window(room, inside, window_side, rng)
    kept_free.append(_door(room, inside, door_side, rng))
    lights += _lamps(room, inside, rng)
    pieces, stands = _furnish(room, inside, kept_free, rng)
    tall = [piece for piece in pieces if piece.high_m > 1.2]
    _pictures(room, inside, {window_side, door_side}, tall, rng)
    return Plan(inside, room, tuple(stands), tuple(pieces), tuple(lights))


def _shell(room: RoomSet, inside: Shell, rng: np.random.Generator) -> None:
    """Floor, ceiling, four walls, one of them in another paper, skirting, and the walls' solids."""
    (x0, y0, _), (_, y1, z1) = inside.low, inside.high
    w, d, h = (float(v) for v in inside.high - inside.low)
    ceiling = plaster(rng, (244, 244, 240), mm_per_px=8.0)
    floor = random_floor(rng, inside)
    room.add(
        quad((x0, y1, 0.0), (w, 0, 0), (0, -d, 0), material=picture(floor)),
        quad((x0, y0, z1), (w, 0, 0), (0, d, 0), material=ceiling),
    )
    usual, feature = random_wallpaper(rng), random_wallpaper(rng)
    other = SIDES[int(rng.integers(4))]
    trim = plain((236, 234, 228) if rng.random() < 0.7 else (120, 96, 72))
    for side in SIDES:
        paper: Material = feature if side == other else usual
        length = d if "x" in side else w
        frame = inside.wall(side, 0.0, 0.0)
        right, out = frame.rotation[:, 0] * length / 2, frame.rotation[:, 2]
        corner = frame.translation - right + np.array([0.0, 0.0, h])
        room.add(quad(corner, 2 * right, (0, 0, -h), material=paper))
        high, thick = SKIRTING_M
        foot = frame.translation - right + out * thick + np.array([0.0, 0.0, high])
        room.add(
            quad(foot, 2 * right, (0, 0, -high), material=trim),
            quad(foot - out * thick, 2 * right, out * thick, material=trim),
        )
        ends = np.stack([frame.translation - right, frame.translation + right])
        ends[1] -= out * WALL_SOLID_M
        ends[1, 2] = h
        room.solid(ends.min(axis=0), ends.max(axis=0))


def _window(
    room: RoomSet, inside: Shell, side: str, rng: np.random.Generator
) -> tuple[list[AreaLight], list[Outline]]:
    length = _length(inside, side)
    size = float(rng.uniform(1.1, min(2.2, length - 1.4))), float(rng.uniform(1.0, 1.4))
    along = float(rng.uniform(-1, 1)) * (length / 2 - size[0] / 2 - 0.6)
    wall = inside.wall(side, along, float(rng.uniform(1.45, 1.65)))
    light = decor.window(room, wall, size, rng, power=float(rng.uniform(9.0, 18.0)))
    # Curtains hang a hand's breadth in front of the wall.
    return [light], [_before_wall(inside, side, along, (size[0] + 1.0, 0.24))]


def _door(room: RoomSet, inside: Shell, side: str, rng: np.random.Generator) -> Outline:
    along = float(rng.uniform(-1, 1)) * (_length(inside, side) / 2 - 0.7)
    room.add(*decor.door(inside.wall(side, along, 0.0), rng))
    return _before_wall(inside, side, along, (1.0, 0.7))


def _lamps(room: RoomSet, inside: Shell, rng: np.random.Generator) -> list[AreaLight]:
    x, y = (0.22 * float(v) for v in (inside.high - inside.low)[:2])
    places = [(0.0, 0.0)] if rng.random() < 0.5 else [(-x, 0.3 * y), (x, -0.3 * y)]
    power = float(rng.uniform(3.0, 8.0))
    lamps: list[AreaLight] = []
    for px, py in places:
        low, high = (px - 0.14, py - 0.5), (px + 0.14, py + 0.5)
        lamps += decor.ceiling_lamp(room, low, high, ceiling_m=inside.high[2], power=power)
    return lamps


def _furnish(
    room: RoomSet, inside: Shell, kept_free: list[Outline], rng: np.random.Generator
) -> tuple[list[Outline], list[Stand]]:
    """Sofa, tables and cabinets: most at a wall, a table or two in the open."""
    names = ["desk", "cabinet" if rng.random() < 0.6 else "shelf"]
    area = float(np.prod((inside.high - inside.low)[:2]))
    extras = ["sofa", "low-table", "shelf", "desk", "cabinet"]
    count = 1 + (area > 15) + (area > 20) + (area > 26)
    names += [extras[int(k)] for k in rng.permutation(len(extras))[:count]]
    taken: list[Outline] = []
    stands: list[Stand] = []
    for name in names:
        piece = FURNITURE[name](rng)
        is_open = name == "low-table" or (name == "desk" and rng.random() < 0.4)
        for _ in range(TRIES):
            pose = _open_place(inside, rng) if is_open else _wall_place(inside, piece, rng)
            outline = _outline(piece, pose)
            fits = outline.is_inside(inside.low[:2], inside.high[:2])
            if fits and not any(overlaps(outline, o, BETWEEN_M) for o in (*taken, *kept_free)):
                _put(room, piece, pose)
                taken.append(outline)
                stands += [_turn(stand, pose) for stand in piece.stands]
                break
    return taken, stands


def _pictures(
    room: RoomSet,
    inside: Shell,
    without: set[str],
    tall: Iterable[Outline],
    rng: np.random.Generator,
) -> None:
    """A picture or two on the walls that have room for it."""
    tall = list(tall)
    for side in SIDES:
        if side in without or rng.random() < 0.2:
            continue
        w, h = float(rng.uniform(0.4, 1.1)), float(rng.uniform(0.4, 0.9))
        for _ in range(TRIES):
            along = float(rng.uniform(-1, 1)) * (_length(inside, side) / 2 - w / 2 - 0.1)
            before = _before_wall(inside, side, along, (w + 0.1, 0.3))
            if not any(overlaps(before, o, 0.0) for o in tall):
                wall = inside.wall(side, along, float(rng.uniform(1.45, 1.7)))
                draw = wall_art.landscape if rng.random() < 0.5 else wall_art.shapes_poster
                art = draw(rng, round(420 * w), round(420 * h))
                room.add(*decor.board(wall, (w, h), art, edge=(56, 52, 50), frame_m=0.022))
                break


def _wall_place(inside: Shell, piece: Furniture, rng: np.random.Generator) -> Pose:
    side = SIDES[int(rng.integers(4))]
    along = float(rng.uniform(-1, 1)) * max(0.0, _length(inside, side) / 2 - piece.size_m[0] / 2)
    at = inside.wall(side, along, 0.0)
    return Pose.from_yaw(YAW[side], at.translation + 0.02 * at.rotation[:, 2])


def _open_place(inside: Shell, rng: np.random.Generator) -> Pose:
    x, y = (float(v) for v in rng.uniform(-0.3, 0.3, 2) * (inside.high - inside.low)[:2])
    return Pose.from_yaw(math.pi / 2 * int(rng.integers(4)), (x, y, 0.0))


def _put(room: RoomSet, piece: Furniture, pose: Pose) -> None:
    room.add(*placed(piece.parts.surfaces, pose))
    room.solids.extend(
        BoxPart(pose @ solid.object_from_box, solid.half_size_m) for solid in piece.parts.solids
    )


def _outline(piece: Furniture, pose: Pose) -> Outline:
    w, d, h = piece.size_m
    box = BoxPart(Pose.from_yaw(0.0, (0.0, -d / 2, h / 2)), (w / 2, d / 2, h / 2))
    return outline_of(box, pose)


def _turn(stand: Stand, pose: Pose) -> Stand:
    corners = pose @ np.array([[*stand.low, stand.z], [*stand.high, stand.z]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    return replace(stand, low=(float(low[0]), float(low[1])), high=(float(high[0]), float(high[1])))


def _before_wall(inside: Shell, side: str, along: float, size: tuple[float, float]) -> Outline:
    """The floor in front of a stretch of wall; `size` is its length and depth."""
    at = inside.wall(side, along, 0.0)
    box = BoxPart(Pose.from_yaw(0.0, (0.0, -size[1] / 2, 1.0)), (size[0] / 2, size[1] / 2, 1.0))
    return outline_of(box, Pose.from_yaw(YAW[side], at.translation))


def _length(inside: Shell, side: str) -> float:
    w, d, _ = (float(v) for v in inside.high - inside.low)
    return d if "x" in side else w


def random_floor(rng: np.random.Generator, inside: Shell) -> Picture:
    """Boards, carpet, tiles or concrete over the whole floor, some with a rug woven in."""
    w, d, _ = (float(v) for v in inside.high - inside.low)
    kind = int(rng.integers(4))
    if kind == 0:
        floor = parquet(rng, mixed(BOARDS, rng), mm_per_px=4.0)(w, d)
    elif kind == 1:
        floor = _carpet(rng, mixed(CARPETS, rng))(w, d)
    elif kind == 2:
        floor = _tiles(rng, mixed(TILES, rng))(w, d)
    else:
        floor = _concrete(rng, mixed(TILES, rng))(w, d)
    floor = np.ascontiguousarray(floor)
    if rng.random() < RUG_SHARE:
        _rug(floor, rng, (w, d))
    return floor


def random_wallpaper(rng: np.random.Generator) -> Material:
    """Paint, stripes or a repeated motif."""
    rgb = mixed(PAPERS, rng)
    kind = int(rng.integers(4))
    if kind < 2:
        return plaster(rng, rgb, mm_per_px=6.0)
    accent = mixed(COLOURS, rng)
    pitch = float(rng.uniform(0.12, 0.4))
    strength = float(rng.uniform(0.15, 0.5))

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 6.0)
        ground = tinted(rgb, 0.01 * noise(rng, shape, cell_px=(2, 2))).astype(np.float32)
        y, x = np.mgrid[0 : shape[0], 0 : shape[1]] * (0.006 / pitch)
        if kind == 2:
            ink = (x % 1.0 < 0.3).astype(np.float32)
        else:
            shift = np.floor(y) % 2 * 0.5
            ink = (np.hypot((x + shift) % 1.0 - 0.5, y % 1.0 - 0.5) < 0.22).astype(np.float32)
        soft: NDArray[np.float32] = np.asarray(cv2.GaussianBlur(ink, (0, 0), 0.8), dtype=np.float32)
        share = strength * soft[..., None]
        mixed_in = ground * (1 - share) + share * np.array(accent, np.float32)
        return mixed_in.clip(0, 255).astype(np.uint8)

    return make


def _carpet(rng: np.random.Generator, rgb: Rgb) -> Material:
    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 5.0)
        speckle = rng.normal(0, 0.06, shape).astype(np.float32)
        return tinted(rgb, speckle + 0.03 * noise(rng, shape, cell_px=(60, 60)))

    return make


def _tiles(rng: np.random.Generator, rgb: Rgb) -> Material:
    side_m = float(rng.uniform(0.2, 0.6))

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 4.0)
        side = round(side_m * 250)
        rows, columns = shape[0] // side + 1, shape[1] // side + 1
        tone = rng.normal(0, 0.04, (rows, columns)).repeat(side, axis=0).repeat(side, axis=1)
        shade = tone[: shape[0], : shape[1]] + 0.02 * noise(rng, shape, cell_px=(20, 20))
        shade[::side], shade[1::side] = -0.25, -0.2
        shade[:, ::side], shade[:, 1::side] = -0.25, -0.2
        return tinted(rgb, shade)

    return make


def _concrete(rng: np.random.Generator, rgb: Rgb) -> Material:
    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 5.0)
        slow = 0.06 * noise(rng, shape, cell_px=(90, 90)) + 0.03 * noise(rng, shape, cell_px=(9, 9))
        return tinted(rgb, slow)

    return make


def _rug(floor: Picture, rng: np.random.Generator, size_m: tuple[float, float]) -> None:
    """A rug of 1.4 to 2.4 m somewhere on the floor, in colours of its own."""
    per_m = int(floor.shape[1]) / size_m[0]
    h, w = (
        round(float(rng.uniform(1.0, 1.6)) * per_m),
        round(float(rng.uniform(1.4, 2.4)) * per_m),
    )
    long, wide = int(floor.shape[0]), int(floor.shape[1])
    h, w = min(h, long - 8), min(w, wide - 8)
    y, x = int(rng.integers(4, long - h)), int(rng.integers(4, wide - w))
    tint = rng.uniform(0.75, 1.2, 3)
    channels = rng.permutation(3)
    rug = np.clip(woven(rng, h, w)[..., channels] * tint, 0, 255)
    floor[y : y + h, x : x + w] = rug.astype(np.uint8)
