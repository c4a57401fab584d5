"""Items to be seen on the headset, by name; only what changed is sent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from scenes.pose import Pose

Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity, 0..1."""

MAX_ITEMS = 512
"""Most items of a list: an avatar has 60, an annotation 20; a list takes the headset 10 ms then."""

MAX_TEXT = 200
"""Most characters of a label that are shown."""


class Shape(IntEnum):
    """Shapes that the headset can draw, within a cube of 1 m: it is scaled by `size_m`.

    Capsule and cylinder stand along z; plane lies in xy; quad stands in xz, seen from its -y side.
    """

    SPHERE = 0
    CAPSULE = 1
    CYLINDER = 2
    CUBE = 3
    PLANE = 4
    QUAD = 5


@dataclass(frozen=True, slots=True)
class Solid:
    """A shape.

    Attributes:
        shape: which.
        world_from_item: the middle of it, in the headset's world, z up.
        size_m: along its own axes x, y, z; what is flat ignores the axis across.
        colour: of all of it.
    """

    shape: Shape
    world_from_item: Pose
    size_m: tuple[float, float, float]
    colour: Colour = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Label:
    """Words in the room, readable from their -y side.

    Attributes:
        text: what is beyond `MAX_TEXT` characters is not shown.
        world_from_item: the middle of it.
        height_m: of a line.
        colour: of the letters.
    """

    text: str
    world_from_item: Pose
    height_m: float = 0.04
    colour: Colour = (1.0, 1.0, 1.0, 1.0)


Item = Solid | Label

DisplayList = Mapping[str, Item]
"""All that is to be seen, by names of the caller: what keeps its name moves, what is gone goes."""
