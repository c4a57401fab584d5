"""Memory for pictures, used again once nobody holds the picture any longer.

Fresh memory costs the operating system a cleared page for every 4 KiB of a picture, a tenth of the
time that a large picture takes. An array whose only reference is ours can be drawn over.
"""

from __future__ import annotations

import sys
import threading
from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from scenes.render.renderer import Rendering

PictureArrays = tuple[
    NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]
]
"""Flat rgb, alpha, depth and ids."""

MOST_BYTES = 256_000_000
"""Kept for later pictures; those of the size used longest ago go first."""
BYTES_PER_PIXEL = 24


class PictureMemory:
    """Arrays of pictures drawn before. May be used from several threads."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, list[PictureArrays]] = OrderedDict()
        self._bytes = 0
        self._lock = threading.Lock()

    def take(self, pixels: int) -> PictureArrays:
        """Arrays for a picture of so many pixels, whatever is in them."""
        with self._lock:
            kept = self._kept.get(pixels, [])
            for place, arrays in enumerate(kept):
                if _holders(arrays) == _NOBODY:
                    self._bytes -= BYTES_PER_PIXEL * pixels
                    return kept.pop(place)
        return _fresh(pixels)

    def give(self, arrays: PictureArrays) -> None:
        """Arrays that were drawn into; whoever still holds them keeps them from being reused."""
        pixels = len(arrays[1])
        with self._lock:
            self._kept.setdefault(pixels, []).append(arrays)
            self._kept.move_to_end(pixels)
            self._bytes += BYTES_PER_PIXEL * pixels
            while self._bytes > MOST_BYTES:
                oldest = next(iter(self._kept))
                if self._kept[oldest]:
                    self._kept[oldest].pop(0)
                    self._bytes -= BYTES_PER_PIXEL * oldest
                else:
                    del self._kept[oldest]


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
    """What `_holders` says of arrays that only a list holds, on this interpreter."""
    kept = [_fresh(1)]
    for _, arrays in enumerate(kept):
        return _holders(arrays)
    raise AssertionError


_NOBODY = _references_of_idle_arrays()
