"""The families of movable objects, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.random_rooms.finishes import DARK, PATTERNED, PLAIN, random_finish
from benchmarks.random_rooms.movable import FLOOR, SEAT, Movable, movable, part
from benchmarks.random_rooms.packed import book, carton, cereal_box, laptop, suitcase
from benchmarks.random_rooms.seats import armchair, dining_chair, stool, swivel_chair
from benchmarks.random_rooms.turned import ball, bottle, lamp, mug, plant_pot, side_table
from scenes.samples.shapes import Surface

GRID = 14
"""Cells along a side of a cushion's face."""


def cushion(rng: np.random.Generator) -> Movable:
    """A lying cushion, thick in the middle and flat at its seam."""
    finish = random_finish(rng, kinds=(PLAIN, PATTERNED, DARK))
    w = float(rng.uniform(0.34, 0.55))
    is_square = rng.random() < 0.5
    d = w if is_square else w * float(rng.uniform(0.6, 0.8))
    t = float(rng.uniform(0.1, 0.17))
    u = np.linspace(-1.0, 1.0, GRID + 1)
    x, y = np.meshgrid(u, u)
    bulge = ((1 - np.abs(x) ** 3.2) * (1 - np.abs(y) ** 3.2)) ** 0.5
    # Sides bend inwards between the corners, as they do on a filled cover.
    rim = np.maximum(np.abs(x), np.abs(y)) ** 4
    inward = 1.0 - 0.07 * rim * (1.0 - np.abs(x * y))
    px, py = 0.5 * w * x * inward, 0.5 * d * y * inward
    upper = np.stack([px, py, 0.5 * t * bulge], axis=2)[::-1]
    lower = np.stack([px, py, -0.5 * t * bulge], axis=2)
    surfaces = [
        Surface(upper, finish.material(w, d)),
        Surface(lower, finish.material(w, d)),
    ]
    even = 4 if is_square else 2
    return movable(
        "cushion", surfaces, [part((0.0, 0.0, 0.0), (0.42 * w, 0.42 * d, t / 2))], finish=finish,
        mass_kg=0.6, symmetry=even if finish.is_even else 1, on=(FLOOR, SEAT),
    )  # fmt: skip


Build = Callable[[np.random.Generator], Movable]
"""A random member of one family."""

FAMILIES: Mapping[str, Build] = {
    "swivel-chair": swivel_chair,
    "dining-chair": dining_chair,
    "armchair": armchair,
    "stool": stool,
    "side-table": side_table,
    "suitcase": suitcase,
    "carton": carton,
    "cushion": cushion,
    "plant-pot": plant_pot,
    "lamp": lamp,
    "laptop": laptop,
    "bottle": bottle,
    "cereal-box": cereal_box,
    "book": book,
    "mug": mug,
    "ball": ball,
}
