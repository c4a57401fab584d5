"""A picture in strips of whole rows, one of which can be replaced without copying the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Value = TypeVar("Value", bound=np.generic)

STRIPS = 24
"""A picture is cut into so many."""


def strip_of(index: int, height: int) -> tuple[int, int]:
    """First row of a strip and the row after its last."""
    return height * index // STRIPS, height * (index + 1) // STRIPS


def strip_with(row: int, height: int) -> int:
    """The strip that a row of a picture is in."""
    return (STRIPS * (row + 1) - 1) // height


@dataclass(frozen=True, slots=True, eq=False)
class Strips(Generic[Value]):
    """An (H, W) or (H, W, C) picture.

    Attributes:
        height: of the whole picture.
        parts: `STRIPS` arrays of whole rows, from top to bottom.
    """

    height: int
    parts: tuple[NDArray[Value], ...]

    @staticmethod
    def of(picture: NDArray[Value]) -> Strips[Value]:
        """A picture in strips; nothing is copied."""
        bounds = (strip_of(index, len(picture)) for index in range(STRIPS))
        return Strips(len(picture), tuple(picture[top:bottom] for top, bottom in bounds))

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the whole picture."""
        return (self.height, *self.parts[0].shape[1:])

    def cut(self, rows: slice, columns: slice) -> list[NDArray[Value]]:
        """A rectangle, or every so many pixels of one, in parts one below the other; no copies.

        Args:
            rows: as of an array.
            columns: as of an array.
        """
        first, stop, step = rows.indices(self.height)
        taken: list[NDArray[Value]] = []
        while first < stop:
            index = strip_with(first, self.height)
            top, _ = strip_of(index, self.height)
            taken.append(self.parts[index][first - top : stop - top : step, columns])
            first += len(taken[-1]) * step
        return taken or [self.parts[0][:0, columns]]

    def __getitem__(self, place: tuple[slice, slice]) -> NDArray[Value]:
        """The rows that `cut` gives, in one piece."""
        parts = self.cut(*place)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def whole(self) -> NDArray[Value]:
        """The picture in one piece."""
        return self[:, :]

    def with_pixels(
        self, where: NDArray[np.bool_], values: NDArray[Value] | Value
    ) -> Strips[Value]:
        """The picture with some pixels replaced; strips without any are not copied.

        Args:
            where: (H, W) which.
            values: (N,) or (N, C) of those, row by row, or one for all.
        """
        parts: list[NDArray[Any]] = []
        size = (int(np.count_nonzero(where)), *self.shape[2:])
        new: NDArray[Any] = np.broadcast_to(np.asarray(values), size)
        top = 0
        for part in self.parts:
            here = where[top : top + len(part)]
            top += len(part)
            count = int(np.count_nonzero(here))
            if count:
                part = part.copy()
                part[here], new = new[:count], new[count:]
            parts.append(part)
        return Strips(self.height, tuple(parts))

    def with_rows(self, top: int, rows: NDArray[Value]) -> Strips[Value]:
        """The picture with some rows replaced."""
        if len(rows) == self.height:
            return Strips[Value].of(rows)
        parts: list[NDArray[Any]] = []
        begin = 0
        for part in self.parts:
            first, last = max(top - begin, 0), min(top + len(rows) - begin, len(part))
            if first < last:
                if last - first < len(part):
                    part = part.copy()
                    part[first:last] = rows[begin + first - top : begin + last - top]
                else:
                    part = rows[begin - top : begin + len(part) - top]
            parts.append(part)
            begin += len(part)
        return Strips(self.height, tuple(parts))
