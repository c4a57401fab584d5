"""The order of points along a Z curve: neighbours in the order are neighbours in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BITS = 16


def z_order(where: NDArray[np.floating]) -> NDArray[np.intp]:
    """Indices of (N, 3) finite points along the curve through a cube of 2^16 cells a side.

    Points in the same cell keep their order.
    """
    if len(where) == 0:
        return np.zeros(0, dtype=np.intp)
    low = where.min(axis=0)
    cell = max(float(np.ptp(where, axis=0).max()), 1e-9) / 2**BITS
    grid = ((where - low) / cell).astype(np.uint64).clip(0, 2**BITS - 1)
    code = np.zeros(len(where), dtype=np.uint64)
    for bit in range(BITS):
        for axis in range(3):
            code |= ((grid[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")
