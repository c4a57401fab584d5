"""Seats: swivel chairs, dining chairs, armchairs, stools. Who sits looks along +Y."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from benchmarks.random_rooms.finishes import (
    DARKS,
    Finish,
    random_finish,
    random_wood,
    smooth,
)
from benchmarks.random_rooms.movable import FLOOR, Movable, movable, part
from scenes.mesh import BoxPart
from scenes.pose import Pose
from scenes.samples.pictures.textures import mixed, plain
from scenes.samples.shapes import (
    OBJECT_CELL_M,
    Material,
    Surface,
    bar,
    lathe,
    placed,
    prism,
    rounded_outline,
)

Point = tuple[float, float, float]
PAD = ((0.02, 0.02), (0.006, 0.014), (0.0, 0.0), (0.006, -0.014), (0.02, -0.02))
"""Rounded edge of a pad 4 cm thick: (inset, height) in metres."""


def swivel_chair(rng: np.random.Generator) -> Movable:
    """An office chair on a star of five castors, with or without arms."""
    finish = random_finish(rng)
    metal = plain(mixed(DARKS, rng) if rng.random() < 0.7 else (176, 178, 182))
    seat_z, seat = float(rng.uniform(0.43, 0.53)), float(rng.uniform(0.44, 0.52))
    back_h = float(rng.uniform(0.34, 0.6))
    reach = float(rng.uniform(0.26, 0.33))
    surfaces: list[Surface] = [
        lathe([(0.0, seat_z), (0.026, seat_z), (0.026, 0.08), (0.0, 0.08)], material=metal)
    ]
    for k in range(5):
        a = 2 * math.pi * k / 5 + math.pi / 2
        tip = np.array([reach * math.cos(a), reach * math.sin(a), 0.075])
        surfaces += bar((0.0, 0.0, 0.1), tip, width=0.04, depth=0.03, material=metal)
        surfaces.append(_castor(tip, metal))
    surfaces += _pad(seat, 0.95 * seat, finish.material, Pose.from_yaw(0.0, (0.0, 0.0, seat_z)))
    lean = float(rng.uniform(0.06, 0.2))
    middle = seat_z + 0.12 + back_h / 2
    at = (0.0, -0.46 * seat, middle)
    surfaces += _pad(0.92 * seat, back_h, finish.material, _upright(at, lean))
    surfaces += bar(
        (0.0, -0.2 * seat, seat_z - 0.02), (0.0, -0.5 * seat, middle - 0.1), width=0.06,
        depth=0.02, material=metal,
    )  # fmt: skip
    if rng.random() < 0.5:
        surfaces += _arms(seat, seat_z, float(rng.uniform(0.18, 0.24)), metal)
    parts = [
        part((0.0, 0.0, 0.05), (0.7 * reach, 0.7 * reach, 0.05)),
        part((0.0, 0.0, seat_z / 2), (0.04, 0.04, seat_z / 2)),
        part((0.0, 0.0, seat_z), (seat / 2, 0.48 * seat, 0.025)),
        part((0.0, -0.47 * seat, middle), (0.46 * seat, 0.05, back_h / 2)),
    ]
    return movable(
        "swivel-chair", surfaces, parts, finish=finish, mass_kg=9.0, symmetry=1, on=(FLOOR,)
    )


def dining_chair(rng: np.random.Generator) -> Movable:
    """A four-legged chair with a panel or slats behind."""
    finish = random_finish(rng)
    frame = random_wood(rng) if rng.random() < 0.6 else plain(mixed(DARKS, rng))
    seat, depth = float(rng.uniform(0.4, 0.48)), float(rng.uniform(0.38, 0.46))
    seat_z, top = float(rng.uniform(0.42, 0.48)), float(rng.uniform(0.78, 1.0))
    thick = float(rng.uniform(0.026, 0.042))
    x, y = 0.44 * seat, 0.42 * depth
    splay = float(rng.uniform(0.0, 0.04))
    surfaces: list[Surface] = []
    for side in (-1.0, 1.0):
        surfaces += _leg((side * (x + splay), y + splay), (side * x, y), seat_z, thick, frame)
        foot = (side * (x + splay), -y - splay, 0.0)
        head = (side * x, -y - 0.05, top)
        surfaces += bar(foot, (side * x, -y, seat_z), width=thick, depth=thick, material=frame)
        surfaces += bar((side * x, -y, seat_z), head, width=thick, depth=thick, material=frame)
    surfaces += _pad(seat, depth, finish.material, Pose.from_yaw(0.0, (0.0, 0.0, seat_z)))
    lean = 0.05 / (top - seat_z)
    if rng.random() < 0.5:
        height = float(rng.uniform(0.18, 0.3))
        at = (0.0, -y - 0.035, top - height / 2)
        surfaces += _pad(0.95 * seat, height, finish.material, _upright(at, lean))
    else:
        for z in np.linspace(seat_z + 0.12, top - 0.03, int(rng.integers(2, 5))):
            place = -y - 0.05 * (float(z) - seat_z) / (top - seat_z)
            surfaces += bar(
                (-x, place, float(z)), (x, place, float(z)), width=0.05, depth=0.018,
                material=frame,
            )  # fmt: skip
    parts = [
        *(part((s * x, t * y, seat_z / 2), (0.03, 0.03, seat_z / 2)) for s in (-1, 1)
          for t in (-1, 1)),
        part((0.0, 0.0, seat_z), (seat / 2, depth / 2, 0.022)),
        part((0.0, -y - 0.03, (seat_z + top) / 2 + 0.05), (x, 0.03, (top - seat_z) / 2 - 0.05)),
    ]  # fmt: skip
    return movable(
        "dining-chair", surfaces, parts, finish=finish, mass_kg=4.5, symmetry=1, on=(FLOOR,)
    )


def armchair(rng: np.random.Generator) -> Movable:
    """An upholstered armchair on short legs."""
    finish = random_finish(rng)
    wide, deep = float(rng.uniform(0.66, 0.84)), float(rng.uniform(0.66, 0.8))
    seat_z, arm_z = float(rng.uniform(0.36, 0.44)), float(rng.uniform(0.54, 0.64))
    top, arm = float(rng.uniform(0.72, 0.95)), float(rng.uniform(0.09, 0.15))
    inner = wide - 2 * arm
    legs = random_wood(rng)
    surfaces: list[Surface] = []
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            foot = (x * (wide / 2 - 0.06), y * (deep / 2 - 0.06))
            surfaces += _leg(foot, foot, 0.13, 0.04, legs)
        at = (x * (wide - arm) / 2, 0.0)
        surfaces += _block((arm, deep), at, (0.12, arm_z), finish)
    surfaces += _block((inner, deep - 0.02), (0.0, 0.0), (0.12, seat_z - 0.1), finish)
    surfaces += _block((inner - 0.01, deep - 0.2), (0.0, 0.09), (seat_z - 0.1, seat_z), finish)
    surfaces += _block((inner, 0.2), (0.0, 0.1 - deep / 2), (0.2, top), finish)
    parts = [
        part((0.0, 0.0, seat_z / 2), (wide / 2, deep / 2, seat_z / 2)),
        part((0.0, 0.1 - deep / 2, top / 2), (wide / 2, 0.1, top / 2)),
        *(part((s * (wide - arm) / 2, 0.0, arm_z / 2), (arm / 2, deep / 2, arm_z / 2))
          for s in (-1, 1)),
    ]  # fmt: skip
    return movable(
        "armchair", surfaces, parts, finish=finish, mass_kg=16.0, symmetry=1, on=(FLOOR,)
    )


def stool(rng: np.random.Generator) -> Movable:
    """A stool with a round or a square seat on three or four legs."""
    finish = random_finish(rng)
    frame = plain(mixed(DARKS, rng)) if rng.random() < 0.4 else smooth(rng, (196, 160, 112))
    is_round = rng.random() < 0.65
    legs = int(rng.choice([3, 4])) if is_round else 4
    width, high = float(rng.uniform(0.28, 0.42)), float(rng.uniform(0.4, 0.7))
    outline = rounded_outline(
        width, width, radius=width / 2 if is_round else 0.02, cell_m=OBJECT_CELL_M
    )
    profile = [(0.008, high), (0.0, high - 0.008), (0.0, high - 0.032), (0.01, high - 0.04)]
    surfaces = prism(outline, profile, side=frame, top=finish.material)
    hip, foot = 0.36 * width, (0.44 if is_round else 0.55) * width
    parts: list[BoxPart] = [part((0.0, 0.0, high - 0.02), (0.42 * width, 0.42 * width, 0.02))]
    for k in range(legs):
        a = 2 * math.pi * (k + 0.5) / legs
        c, s = math.cos(a), math.sin(a)
        surfaces += bar(
            (foot * c, foot * s, 0.0), (hip * c, hip * s, high - 0.03), width=0.032, depth=0.032,
            material=frame, radius=0.016,
        )  # fmt: skip
        parts.append(part((foot * c, foot * s, high / 2), (0.03, 0.03, high / 2)))
    symmetry = legs if finish.is_even else 1
    return movable(
        "stool", surfaces, parts, finish=finish, mass_kg=3.0, symmetry=symmetry, on=(FLOOR,)
    )


def _pad(width: float, depth: float, cloth: Material, place: Pose) -> list[Surface]:
    """A cushioned board 4 cm thick, its middle at `place`."""
    outline = rounded_outline(width, depth, radius=0.05, cell_m=OBJECT_CELL_M)
    return placed(prism(outline, PAD, side=cloth), place)


def _block(
    size: tuple[float, float], at: tuple[float, float], z: tuple[float, float], finish: Finish
) -> list[Surface]:
    """An upholstered block between two heights."""
    outline = rounded_outline(*size, radius=0.035, cell_m=0.04)
    profile = [(0.02, z[1]), (0.006, z[1] - 0.008), (0.0, z[1] - 0.025), (0.0, z[0])]
    solid = prism(outline, profile, side=finish.material, cell_m=0.06)
    return placed(solid, Pose.from_yaw(0.0, (*at, 0.0)))


def _leg(
    foot: tuple[float, float],
    hip: tuple[float, float],
    height: float,
    thick: float,
    material: Material,
) -> list[Surface]:
    return bar((*foot, 0.0), (*hip, height), width=thick, depth=thick, material=material)


def _castor(at: Sequence[float] | np.ndarray, material: Material) -> Surface:
    x, y, _ = (float(v) for v in at)
    profile = [(0.0, 0.075), (0.02, 0.06), (0.028, 0.028), (0.02, 0.006), (0.0, 0.0)]
    wheel = lathe(profile, material=material, around=10)
    return placed([wheel], Pose.from_yaw(0.0, (x, y, 0.0)))[0]


def _arms(seat: float, seat_z: float, rise: float, material: Material) -> list[Surface]:
    surfaces: list[Surface] = []
    for side in (-1.0, 1.0):
        x, z = side * 0.56 * seat, seat_z + rise
        surfaces += bar((x, 0.0, seat_z), (x, 0.0, z), width=0.03, depth=0.05, material=material)
        rest = (x, -0.13, z + 0.012), (x, 0.13, z + 0.012)
        surfaces += bar(*rest, width=0.06, depth=0.024, material=material)
        surfaces += bar(
            (x, 0.0, seat_z), (0.8 * x, 0.0, seat_z - 0.01), width=0.02, depth=0.05,
            material=material,
        )  # fmt: skip
    return surfaces


def _upright(at: Sequence[float], lean: float) -> Pose:
    """A board drawn flat in xy, put up in the xz plane, its top leaning towards -Y by `lean`."""
    c, s = math.cos(lean), math.sin(lean)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, -s, -c], [0.0, c, -s]])
    return Pose(rotation, np.asarray(at, dtype=np.float64))
