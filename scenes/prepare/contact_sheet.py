"""Pictures for a report: all frames at a glance, and where the camera went."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.prepare.capture import Capture
from scenes.prepare.reconstruction import Reconstruction

Picture = NDArray[np.uint8]

GREEN, RED = (40, 160, 70), (210, 50, 40)
INK, PAPER = (40, 40, 40), (250, 250, 248)
BORDER_PX = 4
INNER_SHARE = 0.98
"""Share of the points that the map shows; stray ones would make the room tiny."""


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


def camera_map(reconstruction: Reconstruction, *, size_px: int = 640) -> Picture:
    """Cameras and points seen along the direction in which the cameras spread least, RGB.

    People carry a camera at one height, so this is a plan of the room, from above, before its floor
    is known.
    The green line is the camera's way, short strokes where it looked.
    """
    centres = np.array([view.world_from_camera.translation for view in reconstruction.views])
    ahead = np.array([view.world_from_camera.rotation[:, 2] for view in reconstruction.views])
    plan = np.linalg.svd(centres - centres.mean(axis=0), full_matrices=True)[2][:2]
    down = np.mean([view.world_from_camera.rotation[:, 1] for view in reconstruction.views], axis=0)
    if np.cross(*plan) @ down < 0:
        plan[1] *= -1
    points = reconstruction.points @ plan.T
    way, looks = centres @ plan.T, ahead @ plan.T
    tail = (1 - INNER_SHARE) / 2
    spread = np.quantile(points, [tail, 1 - tail], axis=0) if len(points) else way
    low = np.minimum(spread.min(axis=0), way.min(axis=0))
    high = np.maximum(spread.max(axis=0), way.max(axis=0))
    scale = 0.92 * size_px / max(float((high - low).max()), 1e-9)

    def pixels(at: NDArray[np.float64]) -> NDArray[np.int32]:
        return np.round((at - (low + high) / 2) * scale + size_px / 2).astype(np.int32)

    picture = np.full((size_px, size_px, 3), PAPER, dtype=np.uint8)
    dots = pixels(points)
    inside = ((dots >= 0) & (dots < size_px)).all(axis=1)
    picture[dots[inside, 1], dots[inside, 0]] = reconstruction.colours[inside]
    stroke = 0.04 * size_px / scale
    cv2.polylines(picture, [pixels(way)[:, None]], False, GREEN, 1, cv2.LINE_AA)
    for start, end in zip(pixels(way), pixels(way + stroke * looks), strict=True):
        cv2.line(picture, tuple(map(int, start)), tuple(map(int, end)), INK, 1, cv2.LINE_AA)
        cv2.circle(picture, tuple(map(int, start)), 3, GREEN, -1, cv2.LINE_AA)
    return picture
