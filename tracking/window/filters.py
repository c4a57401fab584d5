"""OpenCV filters with the types that the tracker works in: float32 in, float32 out."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]


def blurred(picture: FloatArray, sigma_px: float) -> FloatArray:
    """Gaussian blur of an (H, W) or (H, W, 3) picture."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma_px), dtype=np.float32)


def bell_blurred(picture: FloatArray, sigma_px: float, reach_px: int) -> FloatArray:
    """Gaussian blur cut off beyond a reach, the border repeated: what the native kernels do."""
    side = 2 * reach_px + 1
    border = cv2.BORDER_REPLICATE
    blurry = cv2.GaussianBlur(picture, (side, side), sigma_px, borderType=border)
    return np.asarray(blurry, dtype=np.float32)


def box_blurred(picture: FloatArray, side_px: int) -> FloatArray:
    """Mean over a square window."""
    return np.asarray(
        cv2.blur(picture, (side_px, side_px), borderType=cv2.BORDER_REPLICATE), dtype=np.float32
    )


def slopes(picture: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives per pixel along x and y."""
    border = cv2.BORDER_REPLICATE
    gx = cv2.Sobel(picture, cv2.CV_32F, 1, 0, ksize=3, scale=0.125, borderType=border)
    gy = cv2.Sobel(picture, cv2.CV_32F, 0, 1, ksize=3, scale=0.125, borderType=border)
    return np.asarray(gx, dtype=np.float32), np.asarray(gy, dtype=np.float32)


def grey(picture: FloatArray) -> FloatArray:
    """Luma of an RGB picture."""
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), dtype=np.float32)


def resized(picture: FloatArray, size_px: tuple[int, int]) -> FloatArray:
    """The picture at another (width, height), averaged when it shrinks."""
    method = cv2.INTER_AREA if size_px[0] < picture.shape[1] else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(picture, size_px, interpolation=method), dtype=np.float32)
