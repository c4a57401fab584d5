# pyright: standard
"""Choice of a video's frames: evenly along the camera's motion, the sharpest of each step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

IndexArray = NDArray[np.int64]

NOT_BESIDE_BORDER = 0.25
"""Share of a step at either end whose frames are taken only if the middle has no usable one."""


@dataclass(frozen=True, slots=True)
class StepLimits:
    """How far the picture may move from one chosen frame to the next, as fractions of its width.

    Attributes:
        smallest: frames that moved less show nothing new.
        largest: frames that moved more share too little.
    """

    smallest: float = 0.02
    largest: float = 0.15


def choose_frames(
    motion: NDArray[np.float64],
    blur: NDArray[np.float64],
    usable: NDArray[np.bool_],
    *,
    wanted: int,
    steps: StepLimits,
) -> IndexArray:
    """The frames to use, in order.

    The path of the picture (the sum of its movements, not the time) is cut into equal steps, and
    each gives its sharpest usable frame: where the camera stood still little is taken, where it
    swept fast much is.

    Args:
        motion: (N,) how far the picture moved since the frame before; the first is ignored.
        blur: (N,) as `sharpness.judge` gives it.
        usable: (N,) which frames may be taken.
        wanted: how many frames; fewer if the camera hardly moved, up to twice as many if it
            moved so far that neighbours would share too little.
        steps: limits of one step.
    """
    path = np.cumsum(np.concatenate([[0.0], motion[1:]]))
    length = float(path[-1])
    most = min(2 * wanted, max(1, int(length / steps.smallest)))
    count = min(max(wanted, int(np.ceil(length / steps.largest))), most)
    place = path / max(length, 1e-12) * count
    cell = np.minimum(place.astype(np.int64), count - 1)
    off_middle = np.abs(place - cell - 0.5)
    penalty = blur + np.where(off_middle > 0.5 - NOT_BESIDE_BORDER, 0.05, 0.0)
    chosen = []
    for number in range(count):
        here = np.flatnonzero((cell == number) & usable)
        if len(here):
            chosen.append(int(here[np.argmin(penalty[here])]))
    return np.array(chosen, dtype=np.int64)
