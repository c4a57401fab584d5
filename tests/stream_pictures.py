"""Pictures as a stream's decoder would give them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.camera.stream_decoder import StreamPicture


def picture_from_rgb(rgb: NDArray[np.uint8]) -> StreamPicture:
    """The planes of an RGB picture (H, W, 3), H and W even, BT.601 full range as in JPEG."""
    ycc = cv2.cvtColor(rgb, cv2.COLOR_RGB2YCrCb)
    half = (rgb.shape[1] // 2, rgb.shape[0] // 2)
    v, u = (
        np.asarray(cv2.resize(ycc[..., k], half, interpolation=cv2.INTER_AREA), np.uint8)
        for k in (1, 2)
    )
    return StreamPicture(np.array(ycc[..., 0], np.uint8), u, v, True, "bt601")
