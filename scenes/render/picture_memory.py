"""Memory for pictures, used again once nobody holds the picture any longer.

Fresh memory costs the operating system a cleared page for every 4 KiB of a picture, a tenth of the
time that a large picture takes. An array whose only reference is ours can be drawn over. The
windows of tracked objects differ by some pixels from frame to frame: memory is roomier than needed,
so that they share what the processor still has at hand.
"""

from __future__ import annotations

import sys
import threading
from collections import OrderedDict
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from scenes.render.renderer import Rendering

PictureArrays = tuple[
    NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]
]
"""Flat rgb, alpha, depth and ids."""

MAX_BYTES = 256_000_000
"""Kept for later pictures; those of the size used longest ago go first."""
BYTES_PER_PIXEL = 24
"""Bytes of a pixel in all pictures of a rendering."""

SMALL_BITS = 17
"""Pictures of up to two to the power of this many pixels are small."""


class PictureMemory:
    """Arrays of pictures drawn before. May be used from several threads."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, list[PictureArrays]] = OrderedDict()
        self._bytes = 0
        self._lock = threading.Lock()

    def take(self, pixels: int) -> PictureArrays:
        """Arrays for a picture of so many pixels, whatever is in them."""
        room = _room_for(pixels)
        with self._lock:
            kept = self._kept.get(room, [])
            # The last one is likeliest to be in the processor's memory still.
            for place in reversed(range(len(kept))):
                if _holders(kept[place]) == _NOBODY:
                    self._bytes -= BYTES_PER_PIXEL * room
                    return _first(kept.pop(place), pixels)
        return _first(_fresh(room), pixels)

    def give(self, arrays: PictureArrays) -> None:
        """Arrays of `take` that were drawn into; whoever still holds them keeps them unchanged."""
        owners = _whole(arrays)
        room = len(owners[1])
        with self._lock:
            self._kept.setdefault(room, []).append(owners)
            self._kept.move_to_end(room)
            self._bytes += BYTES_PER_PIXEL * room
            while self._bytes > MAX_BYTES:
                oldest = next(iter(self._kept))
                if self._kept[oldest]:
                    self._kept[oldest].pop(0)
                    self._bytes -= BYTES_PER_PIXEL * oldest
                else:
                    del self._kept[oldest]


def _room_for(pixels: int) -> int:
    """Pixels of the arrays for a picture: a power of two, or of a large one some eighths of one."""
    bits = max(pixels - 1, 0).bit_length()
    step = 1 << (bits if bits <= SMALL_BITS else bits - 3)
    return -(-pixels // step) * step


def _first(arrays: PictureArrays, pixels: int) -> PictureArrays:
    """As much of arrays as a picture needs."""
    rgb, alpha, depth, ids = arrays
    return rgb[: 3 * pixels], alpha[:pixels], depth[:pixels], ids[:pixels]


def _whole(arrays: PictureArrays) -> PictureArrays:
    """All of the arrays that others are parts of."""
    rgb, alpha, depth, ids = (cast("NDArray[Any]", array.base) for array in arrays)
    return rgb, alpha, depth, ids


def rendering_of(arrays: PictureArrays, height: int, width: int) -> Rendering:
    """The picture that flat rgb, alpha, depth and ids make; shares their memory."""
    rgb, alpha, depth, ids = arrays
    return Rendering(
        rgb.reshape(height, width, 3),
        alpha.reshape(height, width),
        depth.reshape(height, width),
        ids.reshape(height, width),
    )


def _fresh(pixels: int) -> PictureArrays:
    return (
        np.empty(3 * pixels, dtype=np.float32),
        np.empty(pixels, dtype=np.float32),
        np.empty(pixels, dtype=np.float32),
        np.empty(pixels, dtype=np.int32),
    )


def _holders(arrays: PictureArrays) -> int:
    """References to the arrays, views of them included, and to the tuple that holds them."""
    return sum(sys.getrefcount(array) for array in arrays)


def _references_of_idle_arrays() -> int:
    """Count that `_holders` gives for arrays that only a list holds, on this interpreter."""
    kept = [_fresh(1)]
    return _holders(kept[0])


_NOBODY = _references_of_idle_arrays()
