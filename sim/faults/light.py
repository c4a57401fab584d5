"""Gains on linear light, as levels of a picture: what exposure and white balance change."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.faults.fault import Picture


def with_gains(pictures: Sequence[Picture], gains: ArrayLike) -> tuple[Picture, ...]:
    """The pictures (H, W, 3) with red, green and blue light times `gains` (3,), clipped."""
    curve = gain_curve(gains)
    return tuple(np.asarray(cv2.LUT(picture, curve), np.uint8) for picture in pictures)


def gain_curve(gains: ArrayLike) -> NDArray[np.uint8]:
    """(256, 1, 3) sRGB levels after linear light is multiplied by `gains` (3,)."""
    levels = np.arange(256) / 255.0
    linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    lit = np.clip(linear[:, None] * np.asarray(gains, dtype=np.float64), 0.0, 1.0)
    srgb = np.where(lit <= 0.0031308, 12.92 * lit, 1.055 * lit ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * srgb).astype(np.uint8).reshape(256, 1, 3)
