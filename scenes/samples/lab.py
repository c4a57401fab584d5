"""The built-in room `lab`: the paper's study room (paper section 7, figure 9), 6 × 5 × 2.7 m."""

from __future__ import annotations

import math

import numpy as np

from scenes.frames import look_at
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from scenes.samples.atlas import mesh_from_surfaces
from scenes.samples.furniture import Set, shelf_unit, table
from scenes.samples.movables import book, chair, stool
from scenes.samples.shapes import quad
from scenes.samples.textures import parquet, plain, plaster, wood

LOW = np.array([-3.0, -2.5, 0.0])
HIGH = np.array([3.0, 2.5, 2.7])
DESK_TOP_M = 0.74
RIG = np.array([0.6, -0.7, 1.3])


def build() -> PhysicalRoom:
    """The room, lit; the same one each time."""
    rng = np.random.default_rng(2025)
    room = Set()
    _shell(room, rng)
    table(
        room,
        (2.2, -0.65, 0.0),
        (2.95, 0.95, DESK_TOP_M),
        top=wood(rng, (196, 156, 110)),
        legs=plain((70, 72, 76)),
    )
    shelf_unit(
        room, (1.85, 2.16, 0.0), (2.85, 2.48, 1.95), material=wood(rng, (222, 206, 178)), boards=6,
        open_side="-y",
    )  # fmt: skip
    towards_window = np.array([-0.80, 0.18, 0.57])
    return PhysicalRoom(
        name="lab",
        static=(mesh_from_surfaces(room.surfaces, width_px=4096),),
        objects=_objects(),
        solids=tuple(room.solids),
        light_direction=towards_window / np.linalg.norm(towards_window),
        world_from_rig=look_at(RIG, RIG + np.array([0.0, 1.0, 0.0])),
        codes=(),
        footprint_m=np.stack([LOW[:2], HIGH[:2]]),
    )


def _objects() -> tuple[PhysicalObject, ...]:
    return (
        chair("chair-1", Pose.from_yaw(math.radians(-140), (-0.75, 1.0, 0.0))),
        chair("chair-2", Pose.from_yaw(math.radians(-75), (1.35, 0.55, 0.0))),
        stool("stool-1", Pose.from_yaw(math.radians(20), (0.45, 1.45, 0.0))),
        stool("stool-2", Pose.from_yaw(math.radians(50), (-1.35, -0.35, 0.0))),
        book("book-1", Pose.from_yaw(math.radians(-70), (2.45, 0.35, DESK_TOP_M))),
    )


def _shell(room: Set, rng: np.random.Generator) -> None:
    (x0, y0, z0), (x1, y1, z1) = LOW, HIGH
    w, d, h = HIGH - LOW
    wall = plaster(rng, (226, 222, 212))
    room.add(
        quad((x0, y1, z0), (w, 0, 0), (0, -d, 0), material=parquet(rng, (172, 130, 88))),
        quad((x0, y0, z1), (w, 0, 0), (0, d, 0), material=plaster(rng, (240, 240, 238))),
        quad((x0, y1, z1), (w, 0, 0), (0, 0, -h), material=wall),
        quad((x1, y0, z1), (-w, 0, 0), (0, 0, -h), material=wall),
        quad((x1, y1, z1), (0, -d, 0), (0, 0, -h), material=wall),
        quad((x0, y0, z1), (0, d, 0), (0, 0, -h), material=wall),
    )
    t = 0.2
    room.solid((x0 - t, y0 - t, z0), (x0, y1 + t, z1))
    room.solid((x1, y0 - t, z0), (x1 + t, y1 + t, z1))
    room.solid((x0, y0 - t, z0), (x1, y0, z1))
    room.solid((x0, y1, z0), (x1, y1 + t, z1))
