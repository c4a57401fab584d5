"""The furnished room that `nexus bench physics` throws things about in, and what it throws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.twin.scan_like import block, scan_like
from scenes.mesh import BoxPart, PhysicalObject
from scenes.pose import Pose

Block = tuple[tuple[float, float, float], tuple[float, float, float]]

LOW_M, HIGH_M = (0.0, 0.0, 0.0), (6.0, 5.0, 2.8)
"""Inside of the walls."""
SCAN_EDGE_M = 0.066
"""Longest edge of a triangle that makes a scan of 200,000."""
SCAN_NOISE_M = 0.004
"""Of a headset's mesh, standard deviation along each axis."""
BOARD_M = 0.02
SHELF_X_M, SHELF_DEPTH_M = (0.5, 2.3), 0.32
BOARD_HEIGHTS_M = (0.1, 0.5, 0.9, 1.3, 1.7, 2.1)
TABLE_TOP_M = 0.74
DENSITY_KG_PER_M3 = 300.0
"""Of what is thrown: a full carton."""
SMALLEST_M, LARGEST_M = 0.06, 0.3


def furniture() -> tuple[Block, ...]:
    """Lowest and highest corners of the shelves, a table, a sofa and a cupboard, metres."""
    x0, x1 = SHELF_X_M
    depth, top = SHELF_DEPTH_M, BOARD_HEIGHTS_M[-1] + BOARD_M
    return (
        *(((x0, 0.0, z), (x1, depth, z + BOARD_M)) for z in BOARD_HEIGHTS_M),
        *(((x, 0.0, 0.0), (x + BOARD_M, depth, top)) for x in (x0 - BOARD_M, x1)),
        *(
            ((x, y, 0.0), (x + 0.05, y + 0.05, TABLE_TOP_M - 0.03))
            for x in (2.5, 3.75)
            for y in (2.1, 2.75)
        ),
        ((2.4, 2.0, TABLE_TOP_M - 0.03), (3.9, 2.9, TABLE_TOP_M)),
        ((0.6, 4.0, 0.0), (2.6, 5.0, 0.42)),
        ((0.6, 4.8, 0.42), (2.6, 5.0, 0.85)),
        ((5.4, 1.0, 0.0), (6.0, 2.2, 1.9)),
    )


def exact_room() -> NDArray[np.float64]:
    """(T, 3, 3) triangles of the room and its furniture."""
    blocks = [block(low, high) for low, high in furniture()]
    return np.concatenate([block(LOW_M, HIGH_M, is_room=True), *blocks])


def scanned_room(seed: int) -> NDArray[np.float64]:
    """(T, 3, 3) the room as a headset scans it: 200,000 triangles."""
    return scan_like(exact_room(), edge_m=SCAN_EDGE_M, noise_m=SCAN_NOISE_M, seed=seed)


def cartons(count: int, rng: np.random.Generator) -> tuple[PhysicalObject, ...]:
    """Boxes of random sides, above the floor in rows."""
    found: list[PhysicalObject] = []
    for k in range(count):
        x, y, z = (float(side) for side in rng.uniform(SMALLEST_M, LARGEST_M, 3))
        place = (0.8 + 0.9 * (k % 6), 0.8 + 0.8 * (k // 6 % 4), 1.5 + 0.2 * (k // 24))
        part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, 0.5 * z)), (0.5 * x, 0.5 * y, 0.5 * z))
        found.append(
            PhysicalObject(
                object_id=f"carton-{k}",
                kind="carton",
                meshes=(),
                box_m=(x, y, z),
                parts=(part,),
                mass_kg=DENSITY_KG_PER_M3 * x * y * z,
                friction=0.5,
                world_from_object=Pose.from_yaw(float(rng.uniform(-3.0, 3.0)), place),
            )
        )
    return tuple(found)
