"""Splats that come block by block: files of any size are read and written in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from scenes.splats import SH_COUNTS, SplatCloud

ROWS_PER_BLOCK = 65_536
FIRST_ROWS = 1 << 20


@dataclass(slots=True)
class BadRows:
    """Splats that were left out of the blocks read so far, as no scan can have their values.

    Attributes:
        count: how many.
        first: what is wrong with the first; empty without any.
    """

    count: int = 0
    first: str = ""


@dataclass(frozen=True, slots=True)
class SplatBlocks:
    """A cloud of which one block is in memory at a time.

    Attributes:
        count: splats in all blocks together, known before the first is read; bad ones among them
            are left out of the blocks.
        sh_degree: 0 to 3, the same in all blocks.
        blocks: the blocks in order; they can be gone through once. A damaged file is found where
            it is damaged, so the iteration may raise `FormatError`.
        bad: what the blocks read so far leave out.
    """

    count: int
    sh_degree: int
    blocks: Iterator[SplatCloud]
    bad: BadRows = field(default_factory=BadRows)

    def changed(self, change: Callable[[SplatCloud], SplatCloud]) -> SplatBlocks:
        """The same blocks, each of them changed; the number and degree of splats must stay."""
        return replace(self, blocks=map(change, self.blocks))


def extents(count: int, rows: int) -> Iterator[tuple[int, int]]:
    """First and past-the-last splat of each block of at most `rows`."""
    for start in range(0, count, rows):
        yield start, min(start + rows, count)


def in_blocks(cloud: SplatCloud, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """A cloud in memory as blocks, without copying it."""
    blocks = (_part(cloud, slice(*extent)) for extent in extents(len(cloud), rows))
    return SplatBlocks(len(cloud), cloud.sh_degree, blocks)


def whole(splats: SplatBlocks) -> SplatCloud:
    """All blocks as one cloud.

    Beyond the first million splats room is made as blocks arrive, never for a number that a file
    only announces.

    Raises:
        FormatError: the file behind the blocks is damaged.
    """
    k = SH_COUNTS[splats.sh_degree]
    shapes = {"means": (3,), "scales": (3,), "rotations": (4,), "opacities": (), "sh": (k, 3)}
    room = min(splats.count, FIRST_ROWS)
    arrays = {name: np.empty((room, *shape), np.float32) for name, shape in shapes.items()}
    start = 0
    for block in splats.blocks:
        stop = start + len(block)
        if stop > room:
            room = max(stop, min(splats.count, 2 * room))
            for name, array in arrays.items():
                array.resize((room, *shapes[name]), refcheck=False)
        for name, array in arrays.items():
            array[start:stop] = getattr(block, name)
        start = stop
    return owned(**{name: array[:start] for name, array in arrays.items()})


def owned(**arrays: NDArray[np.float32]) -> SplatCloud:
    """A cloud of arrays that nobody else holds, which therefore need no copy."""
    for array in arrays.values():
        array.setflags(write=False)
    return SplatCloud(**arrays)


def _part(cloud: SplatCloud, rows: slice) -> SplatCloud:
    return SplatCloud(
        cloud.means[rows],
        cloud.scales[rows],
        cloud.rotations[rows],
        cloud.opacities[rows],
        cloud.sh[rows],
    )
