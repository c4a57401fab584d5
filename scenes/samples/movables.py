# pyright: standard
"""The movable objects: chair, stool, book, mug, box. Origin on the support plane, Z up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from scenes.mesh import BoxPart, PhysicalObject
from scenes.pose import Pose
from scenes.samples.pictures import graphics
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.textures import Rgb, fabric, picture, plain, wood
from scenes.samples.shapes import (
    OBJECT_CELL_M,
    Surface,
    bar,
    box,
    lathe,
    placed,
    prism,
    rounded_outline,
)

GREY: Rgb = (128, 130, 132)
DARK_GREY: Rgb = (88, 90, 93)


def chair(object_id: str, world_from_object: Pose) -> PhysicalObject:
    """A plain grey four-legged chair, 0.45 × 0.45 × 0.9 m; who sits on it looks along +Y.

    Every chair is the same to the last texel: twins differ in nothing but their place.
    """
    rng = np.random.default_rng(11)
    shell, frame = fabric(rng, GREY, mm_per_px=4.0), plain(DARK_GREY)
    surfaces: list[Surface] = []
    for x in (-1.0, 1.0):
        foot, hip = (0.205 * x, 0.2, 0.0), (0.185 * x, 0.17, 0.435)
        surfaces += bar(foot, hip, width=0.032, depth=0.032, material=frame, radius=0.016, caps="-")
        post = [(0.205 * x, -0.215, 0.0), (0.19 * x, -0.16, 0.45), (0.175 * x, -0.215, 0.84)]
        for a, b in pairwise(post):
            surfaces += bar(a, b, width=0.032, depth=0.032, material=frame, radius=0.016)
        surfaces += bar(
            (0.197 * x, -0.187, 0.2),
            (0.196 * x, 0.186, 0.2),
            width=0.02,
            depth=0.02,
            material=frame,
        )
    seat = rounded_outline(0.45, 0.42, radius=0.06, cell_m=OBJECT_CELL_M)
    cushion = [(0.02, 0.475), (0.006, 0.468), (0.0, 0.455), (0.004, 0.438), (0.02, 0.432)]
    surfaces += placed(prism(seat, cushion, side=shell), Pose.from_yaw(0.0, (0.0, 0.015, 0.0)))
    back = rounded_outline(0.43, 0.30, radius=0.06, cell_m=OBJECT_CELL_M)
    pad = [(0.012, 0.016), (0.0, 0.006), (0.0, -0.006), (0.012, -0.016)]
    lean = math.atan2(0.055, 0.39)
    surfaces += placed(prism(back, pad, side=shell), _upright((0.0, -0.19, 0.747), lean))
    parts = [
        *(_part((0.195 * x, 0.185, 0.2175), (0.026, 0.03, 0.2175)) for x in (-1, 1)),
        *(_part((0.195 * x, -0.19, 0.2175), (0.026, 0.035, 0.2175)) for x in (-1, 1)),
        _part((0.0, 0.015, 0.455), (0.225, 0.21, 0.022)),
        _part((0.0, -0.19, 0.69), (0.215, 0.035, 0.21)),
    ]
    return _object(object_id, "chair", surfaces, parts, (4.5, 0.45), world_from_object)


def stool(object_id: str, world_from_object: Pose) -> PhysicalObject:
    """A round wooden stool, 0.36 m across and 0.45 m high; all stools are twins."""
    rng = np.random.default_rng(12)
    top, frame = wood(rng, (206, 170, 120), mm_per_px=2.0), wood(rng, (190, 152, 104), contrast=0.5)
    seat = rounded_outline(0.36, 0.36, radius=0.18, cell_m=OBJECT_CELL_M)
    surfaces = prism(
        seat, [(0.008, 0.45), (0.0, 0.442), (0.0, 0.424), (0.01, 0.416)], side=frame, top=top
    )
    angles = [math.pi / 4 + k * math.pi / 2 for k in range(4)]
    feet = [np.array([0.16 * math.cos(a), 0.16 * math.sin(a), 0.0]) for a in angles]
    hips = [np.array([0.115 * math.cos(a), 0.115 * math.sin(a), 0.42]) for a in angles]
    for k in range(4):
        surfaces += bar(
            feet[k], hips[k], width=0.034, depth=0.034, material=frame, radius=0.017, taper=0.004
        )
        low, high = (0.72 * feet[i] + 0.28 * hips[i] for i in (k, (k + 1) % 4))
        surfaces += bar(low, high, width=0.02, depth=0.02, material=frame, radius=0.01, caps="")
    parts = [
        _part((0.0, 0.0, 0.433), (0.13, 0.18, 0.017)),
        _part((0.0, 0.0, 0.433), (0.18, 0.13, 0.017)),
        *(_part(0.5 * (feet[k] + hips[k]), (0.026, 0.026, 0.21)) for k in range(4)),
    ]
    return _object(object_id, "stool", surfaces, parts, (2.8, 0.4), world_from_object)


def book(object_id: str, world_from_object: Pose) -> PhysicalObject:
    """A hardcover of 18 × 25 × 3 cm with a busy cover; its title reads along +X, its top is +Y."""
    rng = np.random.default_rng(13)
    front, back, spine = graphics.book_cover(rng)
    w, h, t, board, lip = 0.18, 0.25, 0.03, 0.003, 0.004
    x0, x1, y0, y1 = -w / 2, w / 2, -h / 2, h / 2
    edge = plain((40, 58, 92))
    pages = picture(graphics.page_edges(rng))
    cover = {"material": edge, "faces": "+x+y-y", "cell_m": OBJECT_CELL_M}
    surfaces = [
        *box((x0, y0, t - board), (x1, y1, t), **cover),
        *box((x0, y0, 0.0), (x1, y1, board), **cover),
        *box((x0, y0, t - board), (x1, y1, t), material=edge, faces="-z", cell_m=OBJECT_CELL_M),
        *box((x0, y0, 0.0), (x1, y1, board), material=edge, faces="+z", cell_m=OBJECT_CELL_M),
        *box((x0, y0, 0.0), (x1, y1, t), material=picture(front), faces="+z", cell_m=OBJECT_CELL_M),
        *box((x0, y0, 0.0), (x1, y1, t), material=picture(back), faces="-z", cell_m=OBJECT_CELL_M),
        *box((x0, y0, 0.0), (x1, y1, t), material=picture(spine), faces="-x", cell_m=OBJECT_CELL_M),
        *box(
            (x0, y0 + lip, board),
            (x1 - lip, y1 - lip, t - board),
            material=pages,
            faces="+x+y-y",
            cell_m=OBJECT_CELL_M,
        ),
    ]
    parts = [_part((0.0, 0.0, t / 2), (w / 2, h / 2, t / 2))]
    return _object(object_id, "book", surfaces, parts, (0.9, 0.5), world_from_object)


def mug(object_id: str, world_from_object: Pose) -> PhysicalObject:
    """A mug with a printed band and a handle along +X, 8 cm across and 9.5 cm high."""
    rng = np.random.default_rng(14)
    r, h = 0.04, 0.095
    glaze = plain((226, 222, 212))
    outer = [(0.0, 0.0), (r - 0.004, 0.0), (r, 0.004), (r, h - 0.003), (r - 0.002, h)]
    inner = [(0.0, 0.008), (r - 0.005, 0.008), (r - 0.005, h - 0.002), (r - 0.002, h)]
    wall = lathe(outer[::-1][:4], material=picture(graphics.mug_band(rng)), around=28)
    surfaces = [
        wall,
        lathe(outer[1::-1], material=glaze, around=28),
        lathe(inner, material=glaze, around=28),
    ]
    ring = [
        np.array([r - 0.002 + 0.03 * math.cos(a), 0.0, 0.05 + 0.028 * math.sin(a)])
        for a in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 8)
    ]
    for a, b in pairwise(ring):
        surfaces += bar(a, b, width=0.011, depth=0.009, material=glaze, radius=0.0045, caps="")
    parts = [
        _part((0.0, 0.0, h / 2), (0.85 * r, 0.5 * r, h / 2)),
        _part((0.0, 0.0, h / 2), (0.5 * r, 0.85 * r, h / 2)),
        _part((r + 0.013, 0.0, 0.05), (0.015, 0.006, 0.03)),
    ]
    return _object(object_id, "mug", surfaces, parts, (0.32, 0.45), world_from_object)


def parcel(object_id: str, world_from_object: Pose) -> PhysicalObject:
    """A small printed cardboard box, 16 × 11 × 8 cm."""
    rng = np.random.default_rng(15)
    low, high = (-0.08, -0.055, 0.0), (0.08, 0.055, 0.08)
    surfaces: list[Surface] = []
    for name in ("+x", "-x", "+y", "-y", "+z", "-z"):
        size = (0.11, 0.08) if "x" in name else (0.16, 0.08) if "y" in name else (0.16, 0.11)
        label = graphics.parcel_face(rng, size, name)
        surfaces += box(low, high, material=picture(label), faces=name, cell_m=OBJECT_CELL_M)
    parts = [_part((0.0, 0.0, 0.04), (0.08, 0.055, 0.04))]
    return _object(object_id, "box", surfaces, parts, (0.25, 0.45), world_from_object)


def _upright(at: Sequence[float], lean: float) -> Pose:
    """A board drawn flat in xy, put up in the xz plane, its top leaning towards -Y by `lean`."""
    c, s = math.cos(lean), math.sin(lean)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, -s, -c], [0.0, c, -s]])
    return Pose(rotation, np.asarray(at, dtype=np.float64))


def _part(centre: Sequence[float] | np.ndarray, half: tuple[float, float, float]) -> BoxPart:
    return BoxPart(Pose.from_yaw(0.0, centre), half)


def _object(
    object_id: str,
    kind: str,
    surfaces: Sequence[Surface],
    parts: Sequence[BoxPart],
    mass_and_friction: tuple[float, float],
    world_from_object: Pose,
) -> PhysicalObject:
    """Centres the surfaces and parts over the origin and measures the box."""
    raw = mesh_from_surfaces(surfaces, width_px=1024).bounds()
    shift = Pose(np.eye(3), np.array([*(-raw.mean(axis=0)[:2]), -raw[0, 2]]))
    mesh = mesh_from_surfaces(placed(surfaces, shift), width_px=1024)
    extent = np.ptp(raw, axis=0)
    mass_kg, friction = mass_and_friction
    return PhysicalObject(
        object_id,
        kind,
        (mesh,),
        (float(extent[0]), float(extent[1]), float(extent[2])),
        tuple(BoxPart(shift @ p.object_from_box, p.half_size_m) for p in parts),
        mass_kg,
        friction,
        world_from_object,
    )
