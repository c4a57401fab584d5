"""Decoration of a room: window, door, pictures, shelf contents, plant, sofa, lamp, papers.

What hangs on a wall is built in the wall's frame (x right, y up, z out of the wall) and placed by
the wall's pose.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from scenes import frames
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.samples.furniture import RoomSet
from scenes.samples.light import AreaLight
from scenes.samples.pictures import graphics, wall_art
from scenes.samples.pictures.textures import (
    Rgb,
    fabric,
    mixed,
    picture,
    plain,
    size_px,
    tinted,
    wood,
)
from scenes.samples.shapes import (
    STATIC_CELL_M,
    Material,
    Picture,
    Surface,
    bar,
    box,
    lathe,
    placed,
    prism,
    quad,
    rounded_outline,
)

WHITE: Rgb = (238, 238, 234)


def board(
    world_from_wall: Pose,
    size: tuple[float, float],
    front: Picture,
    *,
    edge: Rgb = WHITE,
    thickness: float = 0.012,
    frame_m: float = 0.0,
    glow: float = 0.0,
) -> list[Surface]:
    """A picture on a board, centred on a wall pose, with a raised frame if `frame_m` > 0."""
    w, h = size[0] / 2, size[1] / 2
    rim = plain(edge)
    face = quad(
        (-w, h, thickness), (2 * w, 0, 0), (0, -2 * h, 0), material=picture(front), glow=glow
    )
    sides = box((-w, -h, 0), (w, h, thickness), material=rim, faces="+x-x+y-y")
    if frame_m:
        t, f = thickness + 0.01, frame_m
        for low, high in (
            ((-w - f, h, 0), (w + f, h + f, t)),
            ((-w - f, -h - f, 0), (w + f, -h, t)),
            ((-w - f, -h, 0), (-w, h, t)),
            ((w, -h, 0), (w + f, h, t)),
        ):
            sides += box(low, high, material=rim, faces="+x-x+y-y+z")
    return placed([face, *sides], world_from_wall)


def code(world_from_wall: Pose, payload: str, side_m: float) -> tuple[list[Surface], QrCode]:
    """A printed QR code on card, with its quiet zone."""
    symbol = graphics.qr_symbol(payload, module_px=6)
    quiet = 4 * 6
    card = np.pad(symbol, ((quiet, quiet), (quiet, quiet), (0, 0)), constant_values=236)
    outer = side_m * card.shape[0] / symbol.shape[0]
    thickness = 0.006
    face = world_from_wall @ Pose.from_yaw(0.0, (0.0, 0.0, thickness))
    return board(world_from_wall, (outer, outer), card, thickness=thickness), QrCode(
        payload, side_m, face
    )


def window(
    room: RoomSet,
    world_from_wall: Pose,
    size: tuple[float, float],
    rng: np.random.Generator,
    *,
    power: float,
) -> AreaLight:
    """A two-leaf window with a sill and curtains; its light shines into the room."""
    w, h = size[0] / 2, size[1] / 2
    view = wall_art.window_view(rng, round(size[0] * 350), round(size[1] * 350))
    white = plain(WHITE)
    parts = [quad((-w, h, 0.008), (2 * w, 0, 0), (0, -2 * h, 0), material=picture(view), glow=1.0)]
    f = 0.07
    for low, high in (
        ((-w - f, h, 0), (w + f, h + f, 0.05)),
        ((-w - f, -h - f, 0), (w + f, -h, 0.05)),
        ((-w - f, -h, 0), (-w, h, 0.05)),
        ((w, -h, 0), (w + f, h, 0.05)),
        ((-0.03, -h, 0), (0.03, h, 0.045)),
        ((-w, h * 0.42, 0), (w, h * 0.42 + 0.035, 0.035)),
        ((-w - 0.14, -h - f - 0.03, 0), (w + 0.14, -h - f, 0.19)),
    ):
        parts += box(low, high, material=white, faces="+x-x+y-y+z")
    cloth = fabric(rng, (196, 204, 206), mm_per_px=6.0)
    for x0, x1 in ((-w - 0.42, -w - 0.02), (w + 0.02, w + 0.42)):
        parts.append(_curtain(x0, x1, -h - 0.75, h + 0.17, cloth))
    parts += bar(
        (-w - 0.5, h + 0.17, 0.1), (w + 0.5, h + 0.17, 0.1), width=0.022, depth=0.022,
        material=plain((90, 92, 96)), cell_m=STATIC_CELL_M,
    )  # fmt: skip
    room.add(*placed(parts, world_from_wall))
    corner = world_from_wall @ np.array([-w, -h, 0.012])
    across, up = (
        world_from_wall.rotation @ np.array([2 * w, 0, 0]),
        world_from_wall.rotation @ np.array([0, 2 * h, 0]),
    )
    return AreaLight(corner, across, up, (0.93 * power, power, 1.09 * power))


def _curtain(x0: float, x1: float, y0: float, y1: float, cloth: Material) -> Surface:
    """A hanging cloth with folds."""
    columns = 17
    s = np.linspace(0, 1, columns)
    t = np.linspace(0, 1, math.ceil((y1 - y0) / 0.1) + 1)
    points = np.empty((len(t), columns, 3))
    points[..., 0] = x0 + (x1 - x0) * s
    points[..., 1] = (y1 + (y0 - y1) * t)[:, None]
    points[..., 2] = 0.1 + 0.022 * np.cos(2 * np.pi * 4 * s) * (0.7 + 0.3 * t[:, None])
    return Surface(points, cloth(x1 - x0, y1 - y0))


def ceiling_lamp(
    room: RoomSet,
    low: tuple[float, float],
    high: tuple[float, float],
    *,
    ceiling_m: float,
    drop_m: float = 0.3,
    power: float,
) -> list[AreaLight]:
    """A flat lamp that hangs `drop_m` under the ceiling and shines down and, less, up."""
    (x0, y0), (x1, y1), t = low, high, 0.04
    bottom = ceiling_m - drop_m
    top = bottom + t
    w, d = x1 - x0, y1 - y0
    glass, steel = plain((255, 250, 238)), plain((200, 202, 204))
    room.add(
        quad((x0, y0, bottom), (w, 0, 0), (0, d, 0), material=glass, glow=1.0),
        quad((x0, y1, top), (w, 0, 0), (0, -d, 0), material=glass, glow=1.0),
        *box((x0, y0, bottom), (x1, y1, top), material=steel, faces="+x-x+y-y"),
    )
    middle = (x0 + x1) / 2
    for y in (y0 + 0.15 * d, y1 - 0.15 * d):
        room.add(
            *bar((middle, y, top), (middle, y, ceiling_m), width=0.006, depth=0.006,
                 material=steel, caps="", cell_m=STATIC_CELL_M)
        )  # fmt: skip
    down, up = np.array([x0, y0, bottom - 0.004]), np.array([x0, y0, top + 0.004])
    across, along = np.array([w, 0.0, 0.0]), np.array([0.0, d, 0.0])
    tint = np.array([1.0, 0.94, 0.83])
    return [
        AreaLight(down, along, across, tuple((power * tint).tolist())),
        AreaLight(up, across, along, tuple((0.6 * power * tint).tolist())),
    ]


def door(world_from_wall: Pose, rng: np.random.Generator) -> list[Surface]:
    """A panelled door, 0.9 × 2.05 m; the wall pose is at its middle, on the floor."""
    h, w = 410, 180
    grey = np.full((h, w), 0.0, dtype=np.float32)
    for top, bottom in ((24, 190), (220, 386)):
        for left, right in ((22, 82), (98, 158)):
            grey[top:bottom, left:right] -= 0.05
            grey[top : top + 3, left:right] -= 0.14
            grey[top:bottom, left : left + 3] -= 0.10
            grey[bottom - 3 : bottom, left:right] += 0.05
    leaf = tinted((226, 220, 206), grey + rng.normal(0, 0.006, (h, w)).astype(np.float32))
    world_from_middle = world_from_wall @ Pose.from_yaw(0.0, (0.0, 1.025, 0.0))
    parts = board(
        world_from_middle, (0.9, 2.05), leaf, thickness=0.02, edge=(206, 200, 186), frame_m=0.07
    )
    steel = plain((150, 152, 156))
    handle = [(0.37, 1.03, 0.02), (0.37, 1.03, 0.065), (0.26, 1.03, 0.065)]
    for a, b in pairwise(handle):
        parts += placed(
            bar(a, b, width=0.018, depth=0.018, material=steel, radius=0.009), world_from_wall
        )
    return parts


def radiator(room: RoomSet, world_from_wall: Pose, size: tuple[float, float]) -> None:
    """A ribbed panel radiator, centred on the wall pose."""
    w, h = size[0] / 2, size[1] / 2
    columns = np.arange(round(size[0] * 400))
    ribs = 0.10 * np.cos(2 * np.pi * columns / 16.0) - 0.04
    front = tinted((232, 232, 228), np.broadcast_to(ribs, (12, len(columns))).astype(np.float32))
    faces = [quad((-w, h, 0.1), (2 * w, 0, 0), (0, -2 * h, 0), material=picture(front))]
    faces += box((-w, -h, 0.03), (w, h, 0.1), material=plain((206, 206, 202)), faces="+x-x+y-y")
    room.add(*placed(faces, world_from_wall))
    corners = np.stack(
        [world_from_wall @ np.array([-w, -h, 0.0]), world_from_wall @ np.array([w, h, 0.1])]
    )
    room.solid(corners.min(axis=0), corners.max(axis=0))


def books_on_board(
    room: RoomSet, x0: float, x1: float, y_back: float, z: float, rng: np.random.Generator
) -> None:
    """A row of books between `x0` and `x1` on a board at `z`, spines towards -Y."""
    colours = [(176, 60, 48), (40, 84, 120), (222, 188, 96), (60, 110, 84), (70, 62, 92),
               (214, 206, 190), (50, 50, 56), (196, 120, 64)]  # fmt: skip
    x, gap, before = x0, True, (0.0, 0.0)
    while x < x1 - 0.05:
        w, h, d = rng.uniform(0.018, 0.048), rng.uniform(0.19, 0.27), rng.uniform(0.13, 0.166)
        if rng.random() < 0.08:
            x, gap = x + rng.uniform(0.04, 0.1), True
            continue
        cover = mixed(colours, rng)
        low, high = (x, y_back - d, z), (x + w, y_back, z + h)
        room.add(
            *box(low, high, material=plain((222, 214, 196)), faces="+z"),
            *box(low, high, material=picture(graphics.spine(rng, cover, (w, h))), faces="-y"),
        )
        hidden_left = not gap and h <= before[0] and d <= before[1]
        sides = "+x" if hidden_left else "+x-x"
        room.add(*box(low, high, material=plain(cover), faces=sides))
        x, gap, before = x + w + 0.002, False, (h, d)


def storage_box(
    room: RoomSet, low: tuple[float, float, float], high: tuple[float, float, float],
    rng: np.random.Generator, colour: Rgb,
) -> None:  # fmt: skip
    """A lidded box with a label towards -Y."""
    cloth = fabric(rng, colour)
    lid = high[2] - 0.04
    room.block(low, (high[0], high[1], lid), cloth, faces="+x-x-y")
    room.block(
        (low[0] - 0.004, low[1] - 0.004, lid), (high[0] + 0.004, high[1], high[2]), cloth,
        faces="+x-x-y+z-z",
    )  # fmt: skip
    middle = (low[0] + high[0]) / 2
    room.block(
        (middle - 0.045, low[1] - 0.006, low[2] + 0.06), (middle + 0.045, low[1], low[2] + 0.11),
        plain((236, 232, 220)), faces="-y+x-x+z-z",
    )  # fmt: skip


def plant(room: RoomSet, at: tuple[float, float], rng: np.random.Generator) -> None:
    """A potted plant with long bent leaves, about 1.2 m high."""
    foot = Pose.from_yaw(0.0, (*at, 0.0))
    pot = [(0.15, 0.30), (0.175, 0.30), (0.14, 0.0)]
    clay = fabric(rng, (206, 198, 184), mm_per_px=4.0)
    soil = plain((64, 48, 38))
    room.add(
        *placed(
            [lathe(pot, material=clay), lathe([(0.0, 0.27), (0.15, 0.27)], material=soil)], foot
        )
    )
    room.solid((at[0] - 0.17, at[1] - 0.17, 0.0), (at[0] + 0.17, at[1] + 0.17, 0.9))
    for k in range(30):
        turn = 2.399963 * k + float(rng.normal(0, 0.2))
        length, rise = float(rng.uniform(0.45, 0.76)), float(rng.uniform(0.45, 1.35))
        room.add(*placed([_leaf(length, rise, rng)], foot @ Pose.from_yaw(turn, (0.0, 0.0, 0.28))))


def _leaf(length: float, rise: float, rng: np.random.Generator) -> Surface:
    """A leaf that starts upwards and bends over, along +X."""
    t = np.linspace(0, 1, 9)
    pitch = np.clip(rise, 0.3, 1.45) - 1.5 * t**1.4
    step = length / (len(t) - 1)
    x = np.concatenate([[0.0], np.cumsum(step * np.cos(pitch[:-1]))])
    z = np.concatenate([[0.0], np.cumsum(step * np.sin(pitch[:-1]))])
    half = 0.035 * np.sin(np.pi * np.clip(0.08 + 0.92 * t, 0, 1)) ** 0.8 + 0.002
    side = np.linspace(-1, 1, 3)
    points = np.empty((len(t), 3, 3))
    points[..., 0] = x[:, None]
    points[..., 1] = half[:, None] * side
    points[..., 2] = z[:, None] + 0.25 * half[:, None] * np.abs(side)
    shade = rng.normal(0, 0.05, (40, 16)).astype(np.float32)
    shade[:, 7:9] += 0.25
    green = mixed([(70, 118, 62), (88, 136, 70), (58, 100, 60)], rng)
    return Surface(points, tinted(green, shade + float(rng.normal(0, 0.08))))


def sofa(room: RoomSet, at: tuple[float, float], rng: np.random.Generator) -> None:
    """A two-seat sofa, 1.75 × 0.8 m, its back along y = `at[1]`, facing +Y from x = `at[0]`."""
    foot = Pose.from_yaw(0.0, (*at, 0.0))
    cloth, legs = fabric(rng, (86, 120, 124), mm_per_px=5.0), wood(rng, (150, 110, 74))
    soft = [(0.035, 0.0), (0.012, -0.012), (0.0, -0.045)]

    def cushion(x: float, y: float, size: tuple[float, float], z: tuple[float, float]) -> None:
        outline = rounded_outline(*size, radius=0.05, cell_m=STATIC_CELL_M)
        profile = [(inset, z[1] + dz) for inset, dz in soft] + [(0.0, z[0])]
        solid = prism(outline, profile, side=cloth, caps="+", cell_m=STATIC_CELL_M)
        room.add(*placed(solid, foot @ Pose.from_yaw(0.0, (x, y, 0.0))))

    base = box((0.14, 0.1, 0.12), (1.61, 0.78, 0.28), material=cloth, faces="+y+z-z")
    room.add(*placed(base, foot))
    for x in (0.505, 1.245):
        cushion(x, 0.47, (0.725, 0.62), (0.28, 0.46))
        cushion(x, 0.21, (0.70, 0.17), (0.40, 0.84))
    cushion(0.875, 0.09, (1.75, 0.17), (0.12, 0.78))
    for x in (0.07, 1.68):
        cushion(x, 0.4, (0.14, 0.8), (0.12, 0.60))
    for x in (0.08, 1.67):
        for y in (0.08, 0.72):
            leg = bar((x, y, 0), (x, y, 0.13), width=0.04, depth=0.04, material=legs, caps="")
            room.add(*placed(leg, foot))
    room.solid((at[0], at[1], 0.0), (at[0] + 1.75, at[1] + 0.8, 0.5))
    room.solid((at[0], at[1], 0.5), (at[0] + 1.75, at[1] + 0.2, 0.85))


def monitor(room: RoomSet, world_from_stand: Pose, rng: np.random.Generator) -> None:
    """A desktop monitor and keyboard; the pose is on the desk under the screen, facing its +X."""
    dark = plain((38, 40, 44))
    stand_from_screen = Pose(frames.WORLD_FROM_BOARD_FACING_X.rotation, np.array([0.0, 0.0, 0.31]))
    screen = board(
        world_from_stand @ stand_from_screen, (0.58, 0.33),
        wall_art.editor_screen(rng, 464, 264), edge=(38, 40, 44),
        thickness=0.02, frame_m=0.012, glow=1.0,
    )  # fmt: skip
    back = box((-0.02, -0.30, 0.13), (0.0, 0.30, 0.49), material=dark, faces="-x+y-y+z-z")
    neck = bar((-0.03, 0, 0.01), (-0.03, 0, 0.3), width=0.05, depth=0.03, material=dark, caps="")
    plate = prism(rounded_outline(0.2, 0.26, radius=0.03, cell_m=0.06), [(0, 0.012), (0, 0)],
                  side=dark, caps="+")  # fmt: skip
    keys = np.full((64, 190, 3), 52, dtype=np.uint8)
    for row in range(5):
        for column in range(15):
            keys[5 + 11 * row : 14 + 11 * row, 6 + 12 * column : 16 + 12 * column] = 84
    top = quad((0.26, -0.2, 0.016), (0, 0.4, 0), (0.14, 0, 0), material=picture(keys[:, ::-1]))
    side = box((0.26, -0.2, 0.0), (0.40, 0.2, 0.016), material=dark, faces="+x-x+y-y")
    room.add(*screen, *placed([*back, *neck, *plate, top, *side], world_from_stand))


def desk_lamp(room: RoomSet, at: tuple[float, float, float]) -> None:
    """A small lamp with a cone shade, unlit."""
    foot = Pose.from_yaw(0.0, at)
    steel, shade = plain((60, 62, 66)), plain((214, 170, 70))
    disc = rounded_outline(0.16, 0.16, radius=0.08, cell_m=0.04)
    parts = prism(disc, [(0, 0.02), (0, 0)], side=steel, caps="+")
    parts += bar((0.03, 0, 0.02), (0.02, 0, 0.36), width=0.014, depth=0.014, material=steel,
                 radius=0.007, caps="")  # fmt: skip
    parts += bar((0.02, 0, 0.36), (-0.12, 0, 0.45), width=0.014, depth=0.014, material=steel,
                 radius=0.007, caps="")  # fmt: skip
    cone = lathe([(0.02, 0.10), (0.03, 0.095), (0.085, 0.0)], material=shade)
    parts += placed([cone], Pose.from_yaw(0.0, (-0.14, 0.0, 0.37)))
    room.add(*placed(parts, foot))


def papers(room: RoomSet, world_from_pile: Pose, rng: np.random.Generator) -> None:
    """A small pile of printed sheets, 6 mm high."""
    sheet = np.full((*size_px(0.21, 0.297, 1.5), 3), 240, dtype=np.uint8)
    for row in range(12):
        y = 24 + 13 * row
        sheet[y : y + 4, 14 : int(rng.integers(80, 126))] = 110
    room.add(
        *placed(
            box((-0.105, -0.148, 0.0), (0.105, 0.148, 0.006), material=picture(sheet), faces="+z")
            + box((-0.105, -0.148, 0.0), (0.105, 0.148, 0.006), material=plain((226, 224, 218)),
                  faces="+x-x+y-y"),
            world_from_pile,
        )
    )  # fmt: skip
