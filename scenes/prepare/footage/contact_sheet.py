# pyright: standard
"""All frames of a capture at a glance."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.prepare.footage.capture import Capture

Picture = NDArray[np.uint8]

GREEN, RED = (40, 160, 70), (210, 50, 40)
PAPER = (250, 250, 248)
BORDER_PX = 4


def contact_sheet(
    capture: Capture, *, failed: tuple[str, ...] = (), columns: int = 12, width_px: int = 120
) -> Picture:
    """All chosen frames as thumbnails, (H, W, 3) RGB; those without a place have a red frame."""
    pictures = []
    height = width_px * 3 // 4
    for frame in capture.frames:
        picture = cv2.imread(str(capture.folder / frame.name), cv2.IMREAD_COLOR)
        thumb = np.full((height, width_px, 3), PAPER, dtype=np.uint8)
        if picture is not None:
            scale = min(width_px / picture.shape[1], height / picture.shape[0])
            small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
            thumb[: small.shape[0], : small.shape[1]] = small[:height, :width_px, ::-1]
        colour = RED if frame.name in failed else GREEN
        cv2.rectangle(thumb, (0, 0), (width_px - 1, height - 1), colour, BORDER_PX)
        pictures.append(thumb)
    rows = math.ceil(len(pictures) / columns)
    blank = np.full((height, width_px, 3), PAPER, dtype=np.uint8)
    pictures += [blank] * (rows * columns - len(pictures))
    return np.vstack([np.hstack(pictures[r * columns : (r + 1) * columns]) for r in range(rows)])
