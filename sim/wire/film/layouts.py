"""Lens pictures put into one picture as cameras and their apps do it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.video import side_by_side
from scenes.cameras import Fisheye
from scenes.frames import FRONT_FROM_BACK_LENS

Picture = NDArray[np.uint8]


class Layout(StrEnum):
    """How a simulated camera's picture holds its two lens pictures."""

    SIDE_BY_SIDE = "side_by_side"
    STACKED = "stacked"
    TURNED = "turned"
    """Side by side, a quarter turn clockwise and anticlockwise, as from the X series' sensors."""
    EQUIRECTANGULAR = "equirectangular"
    """All directions in one picture, as phone apps stitch it; its middle is the front lens."""


def lens_size_px(layout: Layout, size_px: tuple[int, int]) -> int:
    """Side of the square lens pictures that fill a picture of a size (width, height).

    Raises:
        ValueError: such a picture cannot be filled; names the ratio that can.
    """
    width, height = size_px
    if layout is Layout.STACKED:
        wanted, side = (height, 2 * width), width
    else:
        wanted, side = (width, 2 * height), height
    if wanted[0] != wanted[1] or side < 16 or side % 2:
        ratio = "1:2" if layout is Layout.STACKED else "2:1"
        raise ValueError(
            f"picture {width}x{height} of layout {layout}: wanted sides of {ratio} and even lens "
            "pictures of at least 16 px"
        )
    return side


def packed(images: Sequence[Picture], layout: Layout, lens: Fisheye) -> Picture:
    """Two square lens pictures (S, S, 3), the front one first, as one picture.

    Args:
        images: front and back.
        layout: how they are put together.
        lens: either of them, for equirectangular pictures.
    """
    return _PACKED[layout](images, lens)


def _stacked(images: Sequence[Picture], lens: Fisheye) -> Picture:
    del lens
    return np.concatenate(list(images), axis=0)


def _turned(images: Sequence[Picture], lens: Fisheye) -> Picture:
    del lens
    ways = (cv2.ROTATE_90_CLOCKWISE, cv2.ROTATE_90_COUNTERCLOCKWISE)
    turned = [
        np.asarray(cv2.rotate(image, way), np.uint8)
        for image, way in zip(images, ways, strict=True)
    ]
    return side_by_side(turned)


def _stitched(images: Sequence[Picture], lens: Fisheye) -> Picture:
    side = images[0].shape[0]
    front, back, is_back = _maps(lens, side)
    picture = _remapped(images[0], front)
    np.copyto(picture, _remapped(images[1], back), where=is_back[None, :, None])
    return picture


def _remapped(image: Picture, xy: NDArray[np.float32]) -> Picture:
    moved = cv2.remap(image, xy[..., 0], xy[..., 1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(moved, np.uint8)


@lru_cache(maxsize=1)
def _maps(
    lens: Fisheye, side: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """Places of the sphere's pixels (S, 2S) in either lens, and the columns that the back sees.

    Taken at infinity: what is near is cut at the seam, as apps cut it.
    """
    right = ((np.arange(2 * side) + 0.5) / (2 * side) - 0.5) * 2.0 * math.pi
    down = ((np.arange(side) + 0.5) / side - 0.5) * math.pi
    across, along = np.meshgrid(right, down)
    rays = np.stack(
        [np.sin(across) * np.cos(along), np.sin(along), np.cos(across) * np.cos(along)], axis=-1
    ).reshape(-1, 3)
    maps = [
        lens.project(rays @ turned)[0].reshape(side, 2 * side, 2).astype(np.float32)
        for turned in (np.eye(3), FRONT_FROM_BACK_LENS.rotation)
    ]
    # Pixel centres lie at halves; OpenCV's at whole numbers.
    front, back = (xy - np.float32(0.5) for xy in maps)
    return front, back, np.abs(right) > 0.5 * math.pi


def _plain(images: Sequence[Picture], lens: Fisheye) -> Picture:
    del lens
    return side_by_side(images)


_PACKED: dict[Layout, Callable[[Sequence[Picture], Fisheye], Picture]] = {
    Layout.SIDE_BY_SIDE: _plain,
    Layout.STACKED: _stacked,
    Layout.TURNED: _turned,
    Layout.EQUIRECTANGULAR: _stitched,
}
