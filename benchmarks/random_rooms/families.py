"""The families of movable objects, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.random_rooms.movable import Movable
from benchmarks.random_rooms.packed import book, carton, cereal_box, laptop, suitcase
from benchmarks.random_rooms.seats import armchair, dining_chair, stool, swivel_chair
from benchmarks.random_rooms.soft import cushion
from benchmarks.random_rooms.turned import ball, bottle, lamp, mug, plant_pot, side_table

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
