"""The built-in room `desk`: the table set-up (paper section 5, table 2) in a small room."""

from __future__ import annotations

import math

import numpy as np

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from scenes.samples import decor
from scenes.samples.furniture import RoomSet, shelf_unit, table
from scenes.samples.light import UnlitRoom
from scenes.samples.movables import book, mug, parcel
from scenes.samples.pictures import wall_art
from scenes.samples.pictures.textures import parquet, plain, wood
from scenes.samples.room import hang_codes, hang_pictures, lit_room, unlit_room
from scenes.samples.shapes import STATIC_CELL_M
from scenes.samples.shell import Shell, shell

BOX = Shell(np.array([-2.2, -1.9, 0.0]), np.array([2.2, 1.9, 2.6]))
TABLE_LOW, TABLE_HIGH = (-0.8, -0.15, 0.0), (0.8, 0.75, 0.74)
RIG = np.array([0.0, -0.3, 1.14])
TOWARDS_WINDOW = np.array([-0.78, 0.25, 0.57]) / np.linalg.norm([-0.78, 0.25, 0.57])


def build() -> PhysicalRoom:
    """The room, lit; the same one each time."""
    return lit_room("desk", unlit, _objects(), inside=BOX, rig=RIG, towards_light=TOWARDS_WINDOW)


def _objects() -> tuple[PhysicalObject, ...]:
    top = TABLE_HIGH[2]
    return (
        book("book-1", Pose.from_yaw(math.radians(15), (-0.22, 0.25, top))),
        mug("mug-1", Pose.from_yaw(math.radians(-30), (0.33, 0.22, top))),
        parcel("box-1", Pose.from_yaw(math.radians(-12), (0.14, 0.48, top))),
    )


def unlit() -> UnlitRoom:
    """Build the fixed part, before there is light."""
    rng = np.random.default_rng(2026)
    room = RoomSet()
    floor = parquet(rng, (186, 150, 110), mm_per_px=4.0)(*(BOX.high - BOX.low)[:2].tolist())
    shell(room, BOX, rng, floor=floor, walls={"+y": (214, 204, 186)})
    lights = [
        decor.window(room, BOX.wall("-x", 0.5, 1.55), (1.5, 1.3), rng, power=14.0),
        *decor.ceiling_lamp(room, (-0.14, -0.5), (0.14, 0.7), ceiling_m=BOX.high[2], power=4.8),
    ]
    top = wood(rng, (214, 182, 140), mm_per_px=2.0)
    table(room, TABLE_LOW, TABLE_HIGH, top=top, legs=plain((226, 226, 222)))
    birch = wood(rng, (226, 208, 176))
    boards = shelf_unit(
        room, (0.55, 1.55, 0.0), (1.75, 1.88, 1.6), material=birch, boards=5, open_side="-y"
    )
    for z in boards[1:3]:
        decor.books_on_board(room, 0.6, float(rng.uniform(1.4, 1.68)), 1.85, z, rng)
    for x in (0.64, 1.0, 1.36):
        low, high = (x, 1.6, boards[0]), (x + 0.28, 1.84, boards[0] + 0.24)
        decor.storage_box(room, low, high, rng, (120, 130, 126))
    decor.storage_box(
        room, (0.7, 1.6, boards[3]), (1.1, 1.84, boards[3] + 0.22), rng, (186, 140, 90)
    )
    decor.plant(room, (-1.75, 1.45), rng)
    art = (
        ("+y", -0.75, 1.55, (0.9, 0.64), wall_art.landscape(rng, 600, 427)),
        ("+x", 0.6, 1.55, (0.6, 0.84), wall_art.shapes_poster(rng, 400, 560)),
        ("-y", 0.2, 1.5, (1.5, 0.95), wall_art.whiteboard(rng, 900, 570)),
    )
    hang_pictures(room, BOX, art, edge=(60, 56, 52), frame_m=0.022)
    room.add(*decor.door(BOX.wall("-y", -1.45, 0.0), rng))
    decor.desk_lamp(room, (0.62, 0.58, TABLE_HIGH[2]))
    decor.papers(room, Pose.from_yaw(math.radians(8), (-0.58, 0.42, TABLE_HIGH[2])), rng)
    codes = hang_codes(room, BOX, "desk", (("+y", 0.15, 1.35), ("+x", -0.5, 1.5)), side_m=0.20)
    reference = np.array([0.0, 0.3, TABLE_HIGH[2] + STATIC_CELL_M])
    return unlit_room("desk", room, codes=codes, lights=lights, reference=reference)
