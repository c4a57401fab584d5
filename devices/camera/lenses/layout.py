"""Layout of the lens pictures in a stream's picture, and how they are turned."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Arrangement(StrEnum):
    """How the pictures of a 360° camera share the picture of its stream."""

    SIDE_BY_SIDE = "side_by_side"
    STACKED = "stacked"
    EQUIRECTANGULAR = "equirectangular"
    ONE_LENS = "one_lens"


LENSES = {
    Arrangement.SIDE_BY_SIDE: 2,
    Arrangement.STACKED: 2,
    Arrangement.EQUIRECTANGULAR: 1,
    Arrangement.ONE_LENS: 1,
}
"""Pictures that an arrangement holds; an equirectangular one holds all directions in one."""


@dataclass(frozen=True, slots=True)
class Box:
    """Pixels `x0 <= x < x0 + width`, `y0 <= y < y0 + height`."""

    x0: int
    y0: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class LensLayout:
    """How a stream's picture holds its lens pictures.

    Attributes:
        arrangement: where they lie.
        turns: by how many quarter turns clockwise each is turned: where 0 shows what is up at the
            top, 1 shows it at the right, 2 at the bottom, 3 at the left.

    Raises:
        ValueError: the number of turns does not suit the arrangement, or one is not 0 to 3.
    """

    arrangement: Arrangement
    turns: tuple[int, ...]

    def __post_init__(self) -> None:
        wanted = LENSES[self.arrangement]
        if len(self.turns) != wanted or not all(turn in range(4) for turn in self.turns):
            raise ValueError(
                f"LensLayout {self.arrangement}: turns {self.turns}, wanted {wanted} of 0 to 3"
            )

    @property
    def shown(self) -> str:
        """For people: the arrangement and the angles."""
        angles = " and ".join(f"{90 * turn}°" for turn in self.turns)
        return f"{self.arrangement.replace('_', ' ')}, turned by {angles}"

    def boxes(self, width_px: int, height_px: int) -> tuple[Box, ...]:
        """Box of each picture in a stream picture of a size; even numbers throughout.

        A lens picture is the largest square that fits its share, in the middle of it.
        """
        if self.arrangement is Arrangement.EQUIRECTANGULAR:
            return (Box(0, 0, width_px & ~1, height_px & ~1),)
        columns = 2 if self.arrangement is Arrangement.SIDE_BY_SIDE else 1
        rows = 2 if self.arrangement is Arrangement.STACKED else 1
        share_x, share_y = width_px // columns, height_px // rows
        side = min(share_x, share_y) & ~1
        return tuple(
            Box(
                (column * share_x + (share_x - side) // 2) & ~1,
                (row * share_y + (share_y - side) // 2) & ~1,
                side,
                side,
            )
            for row in range(rows)
            for column in range(columns)
        )
