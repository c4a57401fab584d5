"""Points of a drawn object that its pose can be measured at: silhouette and texture, in 3D."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from tracking.kernels.reduction import REDUCTION

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

REACH_PX = REDUCTION.reach_px
"""How far from the contour the width of a part and of the gap beside it is looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """Silhouette points of an object drawn at a pose.

    Attributes:
        points: (N, 3) in the object's frame, metres.
        normals: (N, 2) outward in the picture, unit.
        inner_px: (N,) width of the part inside the contour along the normal, at most `REACH_PX`.
        outer_px: (N,) width of the gap outside.
        colours: (N, 3) float32 of the object a little inside.
    """

    points: Points
    normals: Points
    inner_px: Points
    outer_px: Points
    colours: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def thinned(self, step: int) -> Contour:
        """Every so many points of it."""
        return Contour(
            np.ascontiguousarray(self.points[::step]),
            np.ascontiguousarray(self.normals[::step]),
            np.ascontiguousarray(self.inner_px[::step]),
            np.ascontiguousarray(self.outer_px[::step]),
            np.ascontiguousarray(self.colours[::step]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """Surface points of an object drawn at a pose, where its picture has structure.

    Attributes:
        points: (N, 3) in the object's frame, metres.
        values: (N, 3) float32 smoothed colours there.
        slopes: (N, 3, 2) float32 derivative of the colours per picture pixel (x, y).
    """

    points: Points
    values: FloatArray
    slopes: FloatArray

    def __len__(self) -> int:
        return len(self.points)


def lift(camera: Pinhole | Fisheye, pixels: Points, depth_m: Points) -> Points:
    """(N, 2) pixels and their depths (z of a pinhole, range of a fisheye) -> (N, 3) points."""
    rays = camera.unproject(pixels)
    along = rays[:, 2:] if isinstance(camera, Pinhole) else 1.0
    return np.ascontiguousarray(rays / along * depth_m[:, None])


def sample(image: FloatArray, pixels: Points) -> FloatArray:
    """Bilinear values at (..., 2) pixels of an (H, W[, C]) float32 picture; the border repeats."""
    height, width = image.shape[:2]
    x = np.clip(pixels[..., 0] - 0.5, 0.0, width - 1.0)
    y = np.clip(pixels[..., 1] - 0.5, 0.0, height - 1.0)
    left, above = x.astype(np.intp), y.astype(np.intp)
    right, below = np.minimum(left + 1, width - 1), np.minimum(above + 1, height - 1)
    across, down = (x - left).astype(np.float32), (y - above).astype(np.float32)
    if image.ndim == 3:
        across, down = across[..., None], down[..., None]
    upper = image[above, left] + across * (image[above, right] - image[above, left])
    lower = image[below, left] + across * (image[below, right] - image[below, left])
    return np.asarray(upper + down * (lower - upper), dtype=np.float32)
