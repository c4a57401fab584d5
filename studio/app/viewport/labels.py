"""Layout of names over a picture so that each can be read: nearer ones keep their places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

GAP_PX = 1.0
"""Between a label and the one below it."""

MAX_RISE = 3.0
"""A label rises by so many of its heights at most: farther from its owner, nobody knows whose it
is, and it is left out."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A label that somebody wants.

    Attributes:
        x_px: of its middle.
        bottom_px: of its lower edge.
        width_px, height_px: of it.
        depth_m: how far what it names is.
    """

    x_px: float
    bottom_px: float
    width_px: float
    height_px: float
    depth_m: float


@dataclass(frozen=True, slots=True)
class Placed:
    """A label that is shown.

    Attributes:
        number: of what was wanted.
        left_px, top_px: of its upper left corner.
        is_raised: whether it is farther up than wanted.
    """

    number: int
    left_px: float
    top_px: float
    is_raised: bool


def spread(wanted: Sequence[Wanted], width_px: float, height_px: float) -> list[Placed]:
    """Places for labels: none over another, none cut off by the picture's edge.

    The nearest one has its place. One that would cover another rises until it is above it; where it
    would rise by more than `MAX_RISE` of its heights, or out of the picture, the farther one is
    left out. What is named outside the picture has no label.

    Args:
        wanted: in any order.
        width_px: of the picture.
        height_px: of the picture.
    """
    taken: list[tuple[float, float, float, float]] = []
    found: list[Placed] = []
    for number in sorted(range(len(wanted)), key=lambda n: (wanted[n].depth_m, n)):
        label = wanted[number]
        inside = 0 <= label.x_px <= width_px and 0 <= label.bottom_px <= height_px + label.height_px
        if not inside or label.width_px > width_px:
            continue
        left = min(max(label.x_px - 0.5 * label.width_px, 0.0), width_px - label.width_px)
        aim = min(label.bottom_px, height_px) - label.height_px
        top = _free_top(label, left, aim, taken)
        if top < 0 or aim - top > MAX_RISE * label.height_px:
            continue
        taken.append((left, top, left + label.width_px, top + label.height_px))
        found.append(Placed(number, left, top, is_raised=top < aim))
    return found


def _free_top(
    label: Wanted, left: float, top: float, taken: Sequence[tuple[float, float, float, float]]
) -> float:
    """The lowest place at or above one that no label takes."""
    for at_left, at_top, at_right, at_bottom in sorted(taken, key=lambda area: -area[3]):
        beside = left + label.width_px <= at_left or at_right <= left
        if not beside and top < at_bottom and at_top < top + label.height_px:
            top = at_top - GAP_PX - label.height_px
    return top
