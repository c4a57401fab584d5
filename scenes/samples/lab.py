"""The built-in room `lab`: the paper's study room (paper section 7, figure 9), 6 × 5 × 2.7 m."""

from __future__ import annotations

import math

import numpy as np

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.samples import decor
from scenes.samples.furniture import RoomSet, shelf_unit, table
from scenes.samples.light import AreaLight, UnlitRoom
from scenes.samples.movables import book, chair, stool
from scenes.samples.pictures import wall_art
from scenes.samples.pictures.textures import mixed, parquet, plain, wood
from scenes.samples.room import hang_codes, hang_pictures, lit_room, unlit_room
from scenes.samples.shell import Shell, floor_with_rug, shell

BOX = Shell(np.array([-3.0, -2.5, 0.0]), np.array([3.0, 2.5, 2.7]))
DESK_LOW, DESK_HIGH = (2.2, -0.65, 0.0), (2.95, 0.95, 0.74)
RIG = np.array([0.6, -0.7, 1.3])
RUG_LOW, RUG_HIGH = (-1.75, 0.05), (0.95, 1.85)
TOWARDS_WINDOW = np.array([-0.80, 0.18, 0.57]) / np.linalg.norm([-0.80, 0.18, 0.57])


def build() -> PhysicalRoom:
    """The room, lit; the same one each time."""
    return lit_room("lab", unlit, _objects(), inside=BOX, rig=RIG, towards_light=TOWARDS_WINDOW)


def _objects() -> tuple[PhysicalObject, ...]:
    return (
        chair("chair-1", Pose.from_yaw(math.radians(-140), (-0.75, 1.0, 0.0))),
        chair("chair-2", Pose.from_yaw(math.radians(-75), (1.35, 0.55, 0.0))),
        stool("stool-1", Pose.from_yaw(math.radians(20), (0.45, 1.45, 0.0))),
        stool("stool-2", Pose.from_yaw(math.radians(50), (-1.35, -0.35, 0.0))),
        book("book-1", Pose.from_yaw(math.radians(-70), (2.45, 0.35, DESK_HIGH[2]))),
    )


def unlit() -> UnlitRoom:
    """Build the fixed part, before there is light."""
    rng = np.random.default_rng(2025)
    room = RoomSet()
    boards = parquet(rng, (196, 158, 114), mm_per_px=3.0)
    floor = floor_with_rug(BOX, boards, RUG_LOW, RUG_HIGH, wall_art.rug, rng)
    shell(room, BOX, rng, floor=floor, walls={"+y": (196, 208, 204)})
    lights = _window_and_lamps(room, rng)
    codes = _on_the_walls(room, rng)
    _along_the_far_wall(room, rng)
    _desk(room, rng)
    decor.sofa(room, (0.55, -2.46), rng)
    reference = np.array([0.0, 0.6, 0.01])
    return unlit_room("lab", room, codes=codes, lights=lights, reference=reference)


def _window_and_lamps(room: RoomSet, rng: np.random.Generator) -> list[AreaLight]:
    daylight = decor.window(room, BOX.wall("-x", 0.55, 1.62), (1.9, 1.35), rng, power=17.0)
    decor.radiator(room, BOX.wall("-x", 0.55, 0.40), (1.3, 0.5))
    lamps = [
        lamp
        for x in (-1.3, 1.2)
        for lamp in decor.ceiling_lamp(
            room, (x - 0.14, -0.65), (x + 0.14, 0.75), ceiling_m=BOX.high[2], power=5.5
        )
    ]
    return [daylight, *lamps]


def _on_the_walls(room: RoomSet, rng: np.random.Generator) -> tuple[QrCode, ...]:
    posters = (
        ("+x", 0.62, 1.62, (0.6, 0.84), wall_art.landscape(rng, 400, 560)),
        ("+x", -0.12, 1.62, (0.5, 0.7), wall_art.shapes_poster(rng, 334, 467)),
        ("-y", 1.0, 1.62, (0.6, 0.84), wall_art.title_poster(rng, 400, 560)),
        ("-y", 1.85, 1.62, (0.6, 0.84), wall_art.shapes_poster(rng, 400, 560)),
    )
    hang_pictures(room, BOX, posters, edge=(52, 50, 48), frame_m=0.025)
    writing = wall_art.whiteboard(rng, 1000, 600)
    room.add(
        *decor.board(BOX.wall("+y", -1.05, 1.5), (2.0, 1.2), writing, edge=(176, 180, 184),
                     frame_m=0.02),
        *decor.door(BOX.wall("-y", -1.9, 0.0), rng),
    )  # fmt: skip
    tray = plain((176, 180, 184))
    room.block((-1.55, 2.43, 0.86), (-0.55, 2.5, 0.88), tray, faces="+x-x-y+z-z")
    places = (("+y", 0.245, 1.5), ("+x", -1.25, 1.45), ("-y", -0.75, 1.5))
    return hang_codes(room, BOX, "lab", places, side_m=0.24)


def _along_the_far_wall(room: RoomSet, rng: np.random.Generator) -> None:
    birch = wood(rng, (226, 208, 176))
    decor.plant(room, (-2.6, 2.1), rng)
    low, high = (0.5, 2.1, 0.0), (1.7, 2.48, 0.5)
    room.block((low[0], low[1], 0.06), high, birch, faces="+x-x-y+z")
    room.block((0.54, 2.14, 0.0), (1.66, 2.44, 0.06), plain((60, 60, 62)), faces="+x-x-y")
    room.solid(low, high)
    for x in (0.52, 1.11):
        room.block((x, 2.085, 0.08), (x + 0.57, 2.1, 0.48), birch, faces="-y+x-x+z-z")
        room.block(
            (x + 0.24, 2.07, 0.40),
            (x + 0.33, 2.085, 0.415),
            plain((90, 92, 96)),
            faces="-y+x-x+z-z",
        )
    room.add(
        *decor.board(BOX.wall("+y", 1.1, 1.22), (1.12, 0.65), wall_art.call_screen(748, 434),
                     edge=(26, 27, 30), thickness=0.04, frame_m=0.014, glow=1.0),
    )  # fmt: skip
    boards = shelf_unit(
        room, (1.88, 2.16, 0.0), (2.88, 2.48, 1.95), material=birch, boards=6, open_side="-y"
    )
    for z in boards[1:4]:
        decor.books_on_board(room, 1.92, float(rng.uniform(2.55, 2.84)), 2.45, z, rng)
    for x in (1.95, 2.28, 2.6):
        colour = mixed([(150, 126, 100), (96, 116, 126), (176, 166, 150)], rng)
        decor.storage_box(
            room, (x, 2.2, boards[0]), (x + 0.24, 2.44, boards[0] + 0.22), rng, colour
        )
    decor.storage_box(
        room, (1.98, 2.2, boards[4]), (2.3, 2.44, boards[4] + 0.2), rng, (196, 150, 96)
    )
    decor.books_on_board(room, 2.4, 2.84, 2.45, boards[4], rng)


def _desk(room: RoomSet, rng: np.random.Generator) -> None:
    table(room, DESK_LOW, DESK_HIGH, top=wood(rng, (206, 168, 122)), legs=plain((64, 66, 70)))
    top = DESK_HIGH[2]
    decor.monitor(room, Pose.from_yaw(math.radians(172), (2.80, -0.27, top)), rng)
    decor.desk_lamp(room, (2.80, 0.78, top))
    decor.papers(room, Pose.from_yaw(math.radians(-82), (2.72, 0.16, top)), rng)
