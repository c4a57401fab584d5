"""The parts of objects' boxes that no photo saw, as squares of one colour over the splats."""

from __future__ import annotations

import numpy as np

from scenes.coverage.directions import unpacked
from scenes.coverage.sides import BOTTOM, GRID, NORMALS, box_cells
from scenes.pose import Pose
from scenes.state import ObjectModel
from studio.app.viewport.drawing.shapes import Colour, Squares

ORANGE: Colour = (0.95, 0.55, 0.1)
"""Of what nobody saw: no wood or wall has it, and it differs from the green of collision meshes."""

OPACITY = 0.45
"""Of the squares: the splats behind them stay visible."""

OUTSIDE_M = 0.006
"""Of the box, where they are drawn, metres: splats reach past their surface by about this."""


def unseen_squares(item: ObjectModel, world_from_object: Pose) -> Squares | None:
    """The unseen cells of an object's box; None where photos saw all, or nobody has measured it.

    Its underside is left out: it stands on that.

    Args:
        item: the object.
        world_from_object: its pose as it is shown.
    """
    if item.coverage is None:
        return None
    is_unseen = ~unpacked(item.coverage.sides)
    is_unseen[BOTTOM] = False
    if not is_unseen.any():
        return None
    middles = box_cells(item.box_m).points
    found: list[np.ndarray] = []
    for side in np.flatnonzero(is_unseen.any(axis=1)):
        half = np.array(item.box_m) / (2 * GRID) * (1.0 - np.abs(NORMALS[side]))
        first, second = (axis for axis in range(3) if NORMALS[side][axis] == 0.0)
        turns = np.ones((4, 3))
        turns[:, first], turns[:, second] = (-1, 1, 1, -1), (-1, -1, 1, 1)
        cells = middles[side][is_unseen[side]] + OUTSIDE_M * NORMALS[side]
        found.append(cells[:, None, :] + turns * half)
    corners = np.concatenate(found)
    world = (world_from_object @ corners.reshape(-1, 3)).reshape(corners.shape)
    colours = np.tile(ORANGE, (len(corners), 1))
    return Squares(f"unseen {item.object_id}", world, colours, OPACITY)
