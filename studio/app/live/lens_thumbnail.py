"""Small upright lens pictures of a live camera: its layout is confirmed by them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.camera.lenses.layout import LensLayout
from devices.camera.lenses.lens_pictures import lens_pictures
from devices.camera.received import Received
from devices.camera.stream_picture import StreamPicture

GAP_PX = 4
"""Pixels between two lens pictures."""


def lens_thumbnail(
    received: Received, layout: LensLayout | None, *, side_px: int
) -> NDArray[np.uint8]:
    """What the camera shows, its lens pictures upright beside each other.

    Args:
        received: its newest picture.
        layout: how that holds the lenses; None shows it as it came.
        side_px: height, even.

    Returns:
        (side, W, 4) uint8 RGBA, transparent between the pictures.
    """
    if layout is None:
        pictures = [_shrunk(picture, side_px) for picture in received.pictures]
    else:
        pictures = [
            lens
            for picture in received.pictures
            for lens in lens_pictures(picture, layout, lens_size_px=side_px)
        ]
    width = sum(picture.shape[1] for picture in pictures) + GAP_PX * (len(pictures) - 1)
    out = np.zeros((side_px, width, 4), np.uint8)
    left = 0
    for picture in pictures:
        right = left + picture.shape[1]
        out[: picture.shape[0], left:right, :3] = picture
        out[: picture.shape[0], left:right, 3] = 255
        left = right + GAP_PX
    return out


def _shrunk(picture: StreamPicture, height_px: int) -> NDArray[np.uint8]:
    """A whole picture of a height; its planes are shrunk before they become colours."""
    width_px = max(2, round(picture.width_px * height_px / picture.height_px) & ~1)
    planes = [
        np.asarray(cv2.resize(plane, size, interpolation=cv2.INTER_AREA), np.uint8)
        for plane, size in (
            (picture.y, (width_px, height_px)),
            (picture.u, (width_px // 2, height_px // 2)),
            (picture.v, (width_px // 2, height_px // 2)),
        )
    ]
    return picture.to_rgb(planes[0], planes[1], planes[2])
