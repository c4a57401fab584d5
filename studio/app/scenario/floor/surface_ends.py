"""A live surface from above: a line whose ends and middle are dragged; heights stay."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

Part = Literal["left", "right", "whole"]
Corner = Sequence[float]

EDGES: dict[Part, tuple[int, ...]] = {"left": (0, 3), "right": (1, 2), "whole": (0, 1, 2, 3)}
"""Numbers of the corners that a part is: they go clockwise from the top left."""


def middle_of(corners: Sequence[Corner], part: Part) -> tuple[float, float]:
    """(x, y) of the middle of a part, metres.

    Args:
        corners: four (x, y, z), clockwise from the top left.
        part: which.
    """
    of = [corners[k] for k in EDGES[part]]
    return sum(c[0] for c in of) / len(of), sum(c[1] for c in of) / len(of)


def with_part_at(
    corners: Sequence[Corner], part: Part, x: float, y: float
) -> list[tuple[float, float, float]]:
    """The corners after a part was dragged to a place, to the millimetre.

    Args:
        corners: four (x, y, z), clockwise from the top left.
        part: what was dragged.
        x: where its middle is now, metres.
        y: likewise.
    """
    from_x, from_y = middle_of(corners, part)
    moved = {k: (x - from_x, y - from_y) for k in EDGES[part]}
    found: list[tuple[float, float, float]] = []
    for k, corner in enumerate(corners):
        dx, dy = moved.get(k, (0.0, 0.0))
        found.append((round(corner[0] + dx, 3), round(corner[1] + dy, 3), float(corner[2])))
    return found
