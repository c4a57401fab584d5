"""Tools of a view, and the clicks that each has in hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class Tool(StrEnum):
    """The tool in hand."""

    SELECT = "select"
    MOVE = "move"
    TURN = "turn"
    SCALE = "scale"
    MEASURE = "measure"
    DRAW = "draw"
    SURFACE = "surface"


HOLDING = (Tool.SELECT, Tool.MOVE, Tool.TURN, Tool.SCALE)
"""Tools with which a press can take hold of something instead of picking a place."""

HINTS: dict[Tool, str] = {
    Tool.SELECT: "",
    Tool.MOVE: "drag an arrow, or the square to move on the floor",
    Tool.TURN: "drag a ring: upright turns, the others tilt",
    Tool.SCALE: "drag an end to size one side, the square to size all alike",
    Tool.MEASURE: "click two places or more; Esc ends",
    Tool.DRAW: "click places to draw a line through; Enter keeps it, Esc drops it",
    Tool.SURFACE: "click a flat surface's four corners, top left first; Esc leaves",
}
"""Hint for each, shown over the view."""

ICONS: dict[Tool, str] = {
    Tool.SELECT: "mdi6.cursor-default-outline",
    Tool.MOVE: "mdi6.cursor-move",
    Tool.TURN: "mdi6.rotate-3d-variant",
    Tool.SCALE: "mdi6.arrow-expand",
    Tool.MEASURE: "mdi6.ruler",
    Tool.DRAW: "mdi6.draw",
    Tool.SURFACE: "mdi6.vector-square",
}

CORNERS_HINT = "drag a corner to fit the surface"
"""Shown while a live surface is selected."""


@dataclass(frozen=True, slots=True, eq=False)
class InHand:
    """A tool and the places that were picked with it.

    Attributes:
        tool: which.
        places: (3,) world metres each.
    """

    tool: Tool = Tool.SELECT
    places: Sequence[NDArray[np.float64]] = field(default=())

    def picked(self, place: NDArray[np.float64]) -> InHand:
        """With one more place."""
        return replace(self, places=(*self.places, np.asarray(place, dtype=np.float64)))

    def without_last(self) -> InHand:
        """With the newest place taken back."""
        return replace(self, places=self.places[:-1])

    @property
    def is_complete(self) -> bool:
        """Whether nothing more can be picked: a surface has four corners."""
        return self.tool is Tool.SURFACE and len(self.places) == 4
