"""Layout of small pictures over the view: from the upper right, two in a row."""

from __future__ import annotations

from collections.abc import Sequence

MAX_INSETS = 3
"""Small pictures at a time: two points of view and the 360° camera."""

A_ROW = 2
"""In a row: at 1280 × 800 the view is some 640 pixels wide, and a face is seen in 200."""

SHARE = 0.3
"""Of the view's width that one takes."""

MIN_PX = 200
"""One is that wide also in a narrow view, if two are inside it."""

EDGE_PX, GAP_PX = 12, 8
"""To the view's edges, and between two, pixels."""

FOOT_PX = 36
"""Left free at the view's lower edge, where its own words stand, pixels."""

Place = tuple[int, int, int, int]
"""Left, top, width, height, pixels."""


def placed(heights: Sequence[float], width_px: int, height_px: int) -> list[Place]:
    """Places of the pictures, none over another, all inside the view.

    Args:
        heights: of each, over its width.
        width_px: of the view.
        height_px: of the view.
    """
    room = (width_px - 2 * EDGE_PX - (A_ROW - 1) * GAP_PX) // A_ROW
    wide = max(1, min(max(round(SHARE * width_px), MIN_PX), room))
    rows = [heights[at : at + A_ROW] for at in range(0, len(heights), A_ROW)]
    tall = sum(max(row) for row in rows)
    free = height_px - EDGE_PX - FOOT_PX - GAP_PX * max(len(rows) - 1, 0)
    if tall > 0 and wide * tall > free:
        wide = max(1, int(free / tall))
    places: list[Place] = []
    top = EDGE_PX
    for row in rows:
        for number, height in enumerate(row):
            left = width_px - EDGE_PX - (number + 1) * wide - number * GAP_PX
            places.append((left, top, wide, max(1, int(height * wide))))
        top += max(1, int(max(row) * wide)) + GAP_PX
    return places
