"""Drawings and poses as the native kernels take and give them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scenes.pose import Pose
from scenes.render.renderer import Rendering

if TYPE_CHECKING:
    from tracking.kernels.native import DrawnArrays


def arrays_of(drawn: Rendering) -> DrawnArrays:
    """A drawing in the words of the native crate."""
    return {"rgb": drawn.rgb, "alpha": drawn.alpha, "depth": drawn.depth}


def rows_of(a_from_b: Pose) -> list[float]:
    """The twelve numbers of a pose's 3 × 4 matrix, row by row."""
    turned, place = a_from_b.rotation.tolist(), a_from_b.translation.tolist()
    return [value for row, shift in zip(turned, place, strict=True) for value in (*row, shift)]


def pose_of(rows: Sequence[float]) -> Pose:
    """Inverse of `rows_of`."""
    matrix = np.array(rows).reshape(3, 4)
    return Pose(matrix[:, :3], matrix[:, 3])
