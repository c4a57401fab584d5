"""Objects turned on a lathe: plant pots, lamps, bottles, mugs, balls."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from benchmarks.random_rooms.finishes import (
    PATTERNED,
    PLAIN,
    SHINY,
    random_finish,
    smooth,
)
from benchmarks.random_rooms.movable import FLOOR, ROUND, TOP, Movable, movable, part
from benchmarks.random_rooms.prints import printed
from scenes.pose import Pose
from scenes.samples.pictures.textures import mixed, picture, plain
from scenes.samples.shapes import Surface, bar, lathe, placed, prism, rounded_outline

GREENS = ((70, 110, 56), (96, 132, 70), (56, 90, 62), (126, 150, 84))
Profile = list[tuple[float, float]]


def plant_pot(rng: np.random.Generator) -> Movable:
    """A potted plant with bent leaves, different on every side."""
    finish = random_finish(rng)
    r, h = float(rng.uniform(0.07, 0.17)), float(rng.uniform(0.12, 0.3))
    foot = float(rng.uniform(0.6, 0.95)) * r
    soil = h - 0.03
    surfaces = [
        lathe([(r - 0.012, h), (r, h), (foot, 0.0), (0.0, 0.0)], material=finish.material),
        lathe([(0.0, soil), (r - 0.014, soil), (r - 0.012, h)], material=plain((66, 50, 40))),
    ]
    count = int(rng.integers(8, 16))
    tall = float(rng.uniform(1.3, 3.2)) * r
    for k in range(count):
        yaw = 2 * math.pi * (k + float(rng.uniform(-0.35, 0.35))) / count
        leaf = _leaf(rng, tall * float(rng.uniform(0.6, 1.0)), r)
        surfaces += placed(leaf, Pose.from_yaw(yaw, (0.0, 0.0, soil)))
    parts = [
        part((0.0, 0.0, h / 2), (0.8 * r, 0.8 * r, h / 2)),
        part((0.0, 0.0, h + tall / 3), (r, r, tall / 3)),
    ]
    on = (FLOOR, TOP) if r < 0.12 else (FLOOR,)
    return movable("plant-pot", surfaces, parts, finish=finish, mass_kg=3.0, symmetry=1, on=on)


def lamp(rng: np.random.Generator) -> Movable:
    """A floor or a table lamp, unlit: foot, pole, shade."""
    is_tall = rng.random() < 0.5
    finish = random_finish(rng)
    h = float(rng.uniform(1.2, 1.6) if is_tall else rng.uniform(0.34, 0.55))
    shade = float(rng.uniform(0.14, 0.22) if is_tall else rng.uniform(0.09, 0.15))
    top, tall = float(rng.uniform(0.45, 1.0)) * shade, float(rng.uniform(0.9, 1.5)) * shade
    foot = shade * float(rng.uniform(0.65, 0.95))
    metal = plain((58, 58, 60)) if rng.random() < 0.6 else plain((188, 160, 100))
    surfaces = [
        lathe([(0.0, 0.025), (foot, 0.018), (foot, 0.0), (0.0, 0.0)], material=metal),
        lathe([(0.0, h - 0.02), (0.011, h - 0.02), (0.011, 0.02), (0.0, 0.02)], material=metal),
        lathe([(top, h), (shade, h - tall)], material=finish.material),
        lathe([(shade - 0.003, h - tall), (top - 0.003, h)], material=plain((226, 220, 204))),
    ]
    parts = [
        part((0.0, 0.0, 0.012), (0.8 * foot, 0.8 * foot, 0.012)),
        part((0.0, 0.0, h / 2), (0.015, 0.015, h / 2)),
        part((0.0, 0.0, h - tall / 2), (0.8 * shade, 0.8 * shade, tall / 2)),
    ]
    return movable(
        "lamp", surfaces, parts, finish=finish, mass_kg=2.5,
        symmetry=ROUND if finish.is_even else 1, on=(FLOOR,) if is_tall else (TOP,),
    )  # fmt: skip


def bottle(rng: np.random.Generator) -> Movable:
    """A bottle, with a printed label or without."""
    finish = random_finish(rng, kinds=(PATTERNED, SHINY, PLAIN))
    r, h = float(rng.uniform(0.03, 0.05)), float(rng.uniform(0.19, 0.33))
    neck, shoulder = float(rng.uniform(0.3, 0.5)) * r, float(rng.uniform(0.55, 0.72)) * h
    body = smooth(rng, finish.rgb)
    cap = [(0.0, h), (neck + 0.002, h), (neck + 0.002, h - 0.022), (neck, h - 0.022)]
    surfaces = [
        lathe(cap, material=plain((210, 206, 200)), around=24),
        lathe(
            [(neck, h - 0.022), (neck, shoulder + 0.04), (0.8 * r, shoulder + 0.012),
             (r, shoulder)],
            material=body, around=24,
        ),
        lathe([(r, 0.3 * shoulder), (r, 0.006), (r - 0.006, 0.0), (0.0, 0.0)], material=body,
              around=24),
    ]  # fmt: skip
    band = [(r, shoulder), (r, 0.3 * shoulder)]
    size = (2 * math.pi * r, 0.7 * shoulder)
    label = body if finish.is_even else picture(printed(rng, size, finish.rgb))
    surfaces.append(lathe(band, material=label, around=24))
    parts = [
        part((0.0, 0.0, shoulder / 2), (0.8 * r, 0.8 * r, shoulder / 2)),
        part((0.0, 0.0, (shoulder + h) / 2), (neck, neck, (h - shoulder) / 2)),
    ]
    return movable(
        "bottle", surfaces, parts, finish=finish, mass_kg=0.6,
        symmetry=ROUND if finish.is_even else 1, on=(TOP,),
    )  # fmt: skip


def mug(rng: np.random.Generator) -> Movable:
    """A mug with a handle along +X, plain or printed."""
    finish = random_finish(rng)
    r, h = float(rng.uniform(0.036, 0.05)), float(rng.uniform(0.08, 0.12))
    glaze = smooth(rng, finish.rgb)
    size = (2 * math.pi * r, h)
    wall = glaze if finish.is_even else picture(printed(rng, size, finish.rgb))
    surfaces = [
        lathe([(r - 0.002, h), (r, h - 0.003), (r, 0.004)], material=wall, around=24),
        lathe([(r, 0.004), (r - 0.004, 0.0), (0.0, 0.0)], material=glaze, around=24),
        lathe([(0.0, 0.008), (r - 0.005, 0.008), (r - 0.005, h - 0.002), (r - 0.002, h)],
              material=glaze, around=24),
    ]  # fmt: skip
    ring = [
        np.array([r - 0.002 + 0.03 * math.cos(a), 0.0, 0.52 * h + 0.3 * h * math.sin(a)])
        for a in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 8)
    ]
    for a, b in pairwise(ring):
        surfaces += bar(a, b, width=0.011, depth=0.009, material=glaze, radius=0.0045)
    parts = [
        part((0.0, 0.0, h / 2), (0.85 * r, 0.6 * r, h / 2)),
        part((r + 0.013, 0.0, h / 2), (0.015, 0.006, 0.3 * h)),
    ]
    return movable("mug", surfaces, parts, finish=finish, mass_kg=0.3, symmetry=1, on=(TOP,))


def ball(rng: np.random.Generator) -> Movable:
    """A ball; one with a pattern has a yaw."""
    finish = random_finish(rng)
    r = float(rng.uniform(0.05, 0.14))
    angles = np.linspace(0.0, math.pi, 13)
    profile = [(r * math.sin(a), r + r * math.cos(a)) for a in angles]
    profile[0], profile[-1] = (0.0, 2 * r), (0.0, 0.0)
    surface: Surface = lathe(profile, material=finish.material, around=28)
    half = 0.72 * r
    return movable(
        "ball", [surface], [part((0.0, 0.0, r), (half, half, r))], finish=finish, mass_kg=0.4,
        symmetry=ROUND if finish.is_even else 1, on=(FLOOR, TOP) if r < 0.1 else (FLOOR,),
    )  # fmt: skip


def side_table(rng: np.random.Generator) -> Movable:
    """A small round table on a column or on three legs."""
    finish = random_finish(rng)
    metal = plain((50, 50, 52))
    r, h = float(rng.uniform(0.18, 0.3)), float(rng.uniform(0.38, 0.6))
    t = 0.025
    outline = rounded_outline(2 * r, 2 * r, radius=r, cell_m=0.04)
    surfaces = prism(outline, [(0.0, h), (0.0, h - t)], side=metal, top=finish.material)
    parts = [part((0.0, 0.0, h - t / 2), (0.8 * r, 0.8 * r, t / 2))]
    legs = 3 if rng.random() < 0.6 else 0
    for k in range(legs):
        a = 2 * math.pi * k / 3
        c, s = math.cos(a), math.sin(a)
        surfaces += bar(
            (0.85 * r * c, 0.85 * r * s, 0.0), (0.55 * r * c, 0.55 * r * s, h - t), width=0.03,
            depth=0.03, material=metal, radius=0.015,
        )  # fmt: skip
        parts.append(part((0.7 * r * c, 0.7 * r * s, h / 2), (0.04, 0.04, h / 2)))
    if not legs:
        foot: Profile = [(0.02, h - t), (0.02, 0.03), (0.7 * r, 0.015), (0.7 * r, 0.0), (0.0, 0.0)]
        surfaces.append(lathe(foot, material=metal, around=28, cell_m=0.06))
        parts.append(part((0.0, 0.0, h / 2), (0.04, 0.04, h / 2)))
    even = legs if legs else ROUND
    return movable(
        "side-table", surfaces, parts, finish=finish, mass_kg=4.0,
        symmetry=even if finish.is_even else 1, on=(FLOOR,),
    )  # fmt: skip


def _leaf(rng: np.random.Generator, length: float, pot_m: float) -> list[Surface]:
    """A leaf along +X that rises and bends over, seen from both sides."""
    s = np.linspace(0.0, 1.0, 7)
    rise = float(rng.uniform(0.7, 1.1))
    out = 0.1 * pot_m + length * float(rng.uniform(0.25, 0.6)) * s**1.4
    up = length * rise * (s - 0.45 * s**2)
    half = 0.16 * length * np.sin(math.pi * np.clip(s, 0.03, 0.985)) ** 0.8
    points = np.empty((7, 3, 3))
    for k, side in enumerate((-1.0, 0.0, 1.0)):
        points[:, k, 0] = out
        points[:, k, 1] = side * half
        points[:, k, 2] = up + 0.18 * half * abs(side)
    base = mixed(GREENS, rng)
    green = np.empty((12, 6, 3), np.uint8)
    green[:] = base
    green[:, 2:4] = tuple(min(255, int(1.25 * v)) for v in base)
    return [Surface(points, green), Surface(points[:, ::-1], green)]
