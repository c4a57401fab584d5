"""Boxed objects: suitcases, cartons, cereal boxes, books, laptops."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.random_rooms.finishes import (
    COLOURS,
    DARK,
    PATTERNED,
    PLAIN,
    SHINY,
    Finish,
    random_finish,
)
from benchmarks.random_rooms.movable import FLOOR, SEAT, TOP, Movable, movable, part
from benchmarks.random_rooms.prints import printed, sheet
from scenes.pose import Pose
from scenes.samples.pictures.graphics import page_edges
from scenes.samples.pictures.textures import Rgb, mixed, picture, plain
from scenes.samples.pictures.wall_art import editor_screen
from scenes.samples.shapes import (
    OBJECT_CELL_M,
    Material,
    Surface,
    bar,
    box,
    placed,
    prism,
    rounded_outline,
)

CARDBOARD: tuple[Rgb, ...] = ((188, 146, 98), (206, 170, 124), (230, 226, 216))


def suitcase(rng: np.random.Generator) -> Movable:
    """An upright trolley case with wheels and a handle, plain shells ribbed or not."""
    finish = random_finish(rng)
    wide, deep = float(rng.uniform(0.34, 0.5)), float(rng.uniform(0.2, 0.3))
    high = float(rng.uniform(0.5, 0.72))
    trim = plain((52, 52, 54))
    outline = rounded_outline(wide, deep, radius=0.06, cell_m=OBJECT_CELL_M)
    profile = [(0.035, high), (0.01, high - 0.015), (0.0, high - 0.04), (0.0, 0.1),
               (0.01, 0.06), (0.03, 0.045)]  # fmt: skip
    surfaces = prism(outline, profile, side=finish.material)
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            foot = (x * (wide / 2 - 0.05), y * (deep / 2 - 0.05))
            surfaces += bar((*foot, 0.0), (*foot, 0.06), width=0.03, depth=0.04, material=trim)
        rod = (x * 0.28 * wide, -deep / 2 + 0.05)
        surfaces += bar(
            (*rod, high - 0.03), (*rod, high + 0.12), width=0.014, depth=0.014, material=trim
        )
    grip = -deep / 2 + 0.05, high + 0.12
    surfaces += bar(
        (-0.3 * wide, *grip), (0.3 * wide, *grip), width=0.03, depth=0.026, material=trim
    )
    if rng.random() < 0.5:
        for x in np.linspace(-0.38 * wide, 0.38 * wide, 5):
            surfaces += bar(
                (float(x), deep / 2, 0.12), (float(x), deep / 2, high - 0.06), width=0.02,
                depth=0.014, material=finish.material,
            )  # fmt: skip
    parts = [part((0.0, 0.0, high / 2), (wide / 2, deep / 2, high / 2))]
    return movable("suitcase", surfaces, parts, finish=finish, mass_kg=5.0, symmetry=1, on=(FLOOR,))


def carton(rng: np.random.Generator) -> Movable:
    """A cardboard box, printed or bare but for its tape."""
    is_printed = rng.random() < 0.6
    name = PATTERNED if is_printed else PLAIN
    base = mixed(CARDBOARD, rng)
    half = np.array([rng.uniform(0.14, 0.28), rng.uniform(0.11, 0.22), rng.uniform(0.1, 0.24)])
    if half[0] < 1.15 * half[1]:
        half[0] = 1.15 * half[1]
    surfaces = _printed_box(rng, half, base, is_printed=is_printed)
    width = 2 * float(half[0])
    tape = plain((214, 190, 142))
    lid = (-width / 2, -0.025, 2 * float(half[2])), (width / 2, 0.025, 2 * float(half[2]) + 0.001)
    surfaces += box(*lid, material=tape, faces="+z", cell_m=OBJECT_CELL_M)
    return _box_movable(
        "carton", surfaces, half, Finish(name, base, tape), mass_kg=2.5, on=(FLOOR, TOP)
    )


def cereal_box(rng: np.random.Generator) -> Movable:
    """A standing printed package, thin."""
    base = mixed(COLOURS, rng)
    half = np.array([rng.uniform(0.08, 0.11), rng.uniform(0.022, 0.035), rng.uniform(0.12, 0.16)])
    surfaces = _printed_box(rng, half, base, is_printed=True)
    finish = Finish(PATTERNED, base, plain(base))
    return _box_movable("cereal-box", surfaces, half, finish, mass_kg=0.5, on=(TOP, FLOOR))


def book(rng: np.random.Generator) -> Movable:
    """A lying hardcover, printed or in plain cloth."""
    finish = random_finish(rng, kinds=(PLAIN, PATTERNED, DARK))
    w, h = float(rng.uniform(0.13, 0.23)), float(rng.uniform(0.19, 0.31))
    t, lip = float(rng.uniform(0.015, 0.045)), 0.004
    cover: Material = (
        finish.material if finish.is_even else picture(printed(rng, (w, h), finish.rgb))
    )
    low, high = (-w / 2, -h / 2, 0.0), (w / 2, h / 2, t)
    edge = plain(finish.rgb)
    spine = picture(sheet(rng, (h, t), finish.rgb)) if not finish.is_even else edge
    pages = picture(page_edges(rng))
    surfaces = [
        *box(low, high, material=cover, faces="+z-z", cell_m=OBJECT_CELL_M),
        *box(low, high, material=spine, faces="-x", cell_m=OBJECT_CELL_M),
        *box(
            (-w / 2, -h / 2 + lip, 0.003), (w / 2 - lip, h / 2 - lip, t - 0.003), material=pages,
            faces="+x+y-y", cell_m=OBJECT_CELL_M,
        ),
    ]  # fmt: skip
    for z in (0.0, t - 0.003):
        board = (-w / 2, -h / 2, z), (w / 2, h / 2, z + 0.003)
        surfaces += box(*board, material=edge, faces="+x+y-y", cell_m=OBJECT_CELL_M)
    parts = [part((0.0, 0.0, t / 2), (w / 2, h / 2, t / 2))]
    return movable("book", surfaces, parts, finish=finish, mass_kg=0.8, symmetry=1, on=(TOP, SEAT))


def laptop(rng: np.random.Generator) -> Movable:
    """An open laptop: keys, and a screen that shows a text editor or is dark."""
    finish = random_finish(rng, kinds=(PLAIN, DARK, SHINY))
    w, d = float(rng.uniform(0.29, 0.37)), float(rng.uniform(0.2, 0.26))
    t, angle = 0.016, float(rng.uniform(1.75, 2.15))
    low, high = (-w / 2, -d / 2, 0.0), (w / 2, d / 2, t)
    surfaces = box(low, high, material=finish.material, faces="+x-x+y-y-z", cell_m=OBJECT_CELL_M)
    surfaces += box(low, high, material=picture(_keys(rng, finish.rgb)), faces="+z", cell_m=0.03)
    lid = (-w / 2, 0.0, 0.0), (w / 2, d, 0.007)
    shown = editor_screen(rng, 320, 210) if rng.random() < 0.6 else np.full((8, 8, 3), 18, np.uint8)
    screen = box(lid[0], lid[1], material=picture(shown), faces="+z", cell_m=OBJECT_CELL_M)
    case = box(lid[0], lid[1], material=finish.material, faces="+x-x+y-y-z", cell_m=OBJECT_CELL_M)
    tilt = math.pi - angle
    c, s = math.cos(tilt), math.sin(tilt)
    # The screen's face looks towards -Y and up, to who sits in front of the keys.
    turned = Pose(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), np.array([0.0, d / 2, t]))
    surfaces += placed([*screen, *case], turned)
    rise, back = d * math.sin(tilt), d * math.cos(tilt)
    parts = [
        part((0.0, 0.0, t / 2), (w / 2, d / 2, t / 2)),
        part((0.0, d / 2 + back / 2, t + rise / 2), (w / 2, max(0.01, back / 2), rise / 2)),
    ]
    return movable("laptop", surfaces, parts, finish=finish, mass_kg=1.6, symmetry=1, on=(TOP,))


def _printed_box(
    rng: np.random.Generator, half: np.ndarray, base: Rgb, *, is_printed: bool
) -> list[Surface]:
    """A box on z = 0 whose faces are printed, each differently, or bare."""
    x, y, z = (float(v) for v in half)
    surfaces: list[Surface] = []
    for face in ("+x", "-x", "+y", "-y", "+z", "-z"):
        size = {"x": (2 * y, 2 * z), "y": (2 * x, 2 * z), "z": (2 * x, 2 * y)}[face[1]]
        if not is_printed:
            front: Material = plain(base)
        elif "x" in face or face == "-z":
            front = picture(sheet(rng, size, base))
        else:
            front = picture(printed(rng, size, base))
        surfaces += box((-x, -y, 0.0), (x, y, 2 * z), material=front, faces=face, cell_m=0.04)
    return surfaces


def _box_movable(
    family: str,
    surfaces: list[Surface],
    half: np.ndarray,
    finish: Finish,
    *,
    mass_kg: float,
    on: tuple[str, ...],
) -> Movable:
    x, y, z = (float(v) for v in half)
    return movable(
        family, surfaces, [part((0.0, 0.0, z), (x, y, z))], finish=finish, mass_kg=mass_kg,
        symmetry=2 if finish.is_even else 1, on=on,
    )  # fmt: skip


def _keys(rng: np.random.Generator, base: Rgb) -> np.ndarray:
    """A keyboard and a pad below it, seen from above; the screen is at the top."""
    keys = np.empty((160, 240, 3), np.uint8)
    keys[:] = base
    dark = sum(base) < 240
    cap = (74, 74, 78) if dark else (40, 40, 44)
    for row in range(5):
        x = 14 + int(rng.integers(0, 6))
        while x < 220:
            wide = int(rng.choice([13, 13, 13, 20]))
            keys[14 + 17 * row : 27 + 17 * row, x : min(x + wide, 226)] = cap
            x += wide + 3
    keys[108:150, 84:156] = tuple(int(0.8 * v + 16) for v in base)
    return keys
