"""Whether a stream's picture shows lens circles where an arrangement has them: dark corners."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.camera.lenses.layout import Arrangement, Box, LensLayout

Luma = NDArray[np.float32]

INSIDE, OUTSIDE = 0.85, 1.08
"""Radii over half a share's side: nearer is inside the circle, farther outside, between is neither.

Circles of real cameras reach 1.00 to 1.05 of it; lens flare brightens the first few per cent."""

LONG_SIDE_PX = 384
"""Length to which a picture is shrunk before it is looked at."""


def shrunk(luma: NDArray[np.uint8]) -> Luma:
    """A picture's Y plane (H, W) at the size at which it is looked at."""
    scale = LONG_SIDE_PX / max(luma.shape)
    size = (max(8, round(luma.shape[1] * scale)), max(8, round(luma.shape[0] * scale)))
    return np.asarray(cv2.resize(luma, size, interpolation=cv2.INTER_AREA), np.float32)


def darkness_outside(luma: Luma, arrangement: Arrangement) -> float:
    """Probability that a pixel outside the circles is darker than one inside, minus ½, doubled.

    1 where everything outside is darker than everything inside, 0 where there is no difference.
    """
    boxes = LensLayout(arrangement, (0,) * (1 if arrangement is Arrangement.ONE_LENS else 2)).boxes(
        luma.shape[1], luma.shape[0]
    )
    radii = np.min([_radii(luma, box) for box in boxes], axis=0)
    outside = np.sort(luma[radii > OUTSIDE])
    inside = luma[radii < INSIDE]
    if not len(outside) or not len(inside):
        return 0.0
    below = np.searchsorted(outside, inside, side="left")
    up_to = np.searchsorted(outside, inside, side="right")
    return float((below + up_to).mean() / len(outside) - 1.0)


def _radii(luma: Luma, box: Box) -> NDArray[np.float64]:
    """Distance of every pixel from the middle of a box, over half its side."""
    y, x = np.mgrid[: luma.shape[0], : luma.shape[1]]
    half = 0.5 * box.width
    return np.hypot(x + 0.5 - box.x0 - half, y + 0.5 - box.y0 - half) / half
