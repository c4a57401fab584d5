"""360° pictures in the equirectangular projection: recognised, and cut into flat views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

SHAPE_TOLERANCE = 0.01
"""Of width over height, which is 2."""
MAX_EDGE_SHARE = 0.35
"""Difference between the left and the right edge, against that between columns an eighth apart or
more: the edges are neighbours in the room. 0.12 in a film of the built-in lab."""
MAX_POLE_SHARE = 0.3
"""Contrast along the topmost and the lowest row, each a single point of the room, against that
along the middle one: 0.02 to 0.07 there."""
MIN_CONTRAST = 4.0
"""Grey levels of the middle row: without any nothing is recognised."""
DARK = 14.0
"""Mean grey level in the corners beside fisheye circles."""
METADATA = (b"sv3d", b"GSpherical:Spherical", b"GPano:ProjectionType")
METADATA_BYTES = 4 << 20
"""Spherical metadata lie near the start or the end of a file, with the other metadata."""
VIEWS = 6
"""Views around the horizon: neighbours share a third of their width."""
FIELD_OF_VIEW = math.radians(90.0)
"""Field of view of each, radians."""
LABELS = "abcdef"


@dataclass(frozen=True, slots=True, eq=False)
class FlatView:
    """A pinhole view of an equirectangular picture.

    Attributes:
        label: a letter, from the left.
        focal_px: of the view.
        columns: (S, S) where in the picture each pixel comes from.
        rows: (S, S) likewise.
    """

    label: str
    focal_px: float
    columns: NDArray[np.float32]
    rows: NDArray[np.float32]


def has_spherical_metadata(file: Path) -> bool:
    """Whether a file says of itself that its pictures are spherical (Google's video and photo RFC).

    Raises:
        OSError: it cannot be read.
    """
    with file.open("rb") as opened:
        head = opened.read(METADATA_BYTES)
        opened.seek(max(0, file.stat().st_size - METADATA_BYTES))
        both = head + opened.read(METADATA_BYTES)
    return any(mark in both for mark in METADATA)


def is_two_to_one(width: int, height: int) -> bool:
    """Whether a picture has the shape of a whole sphere."""
    return abs(width / height / 2 - 1) <= SHAPE_TOLERANCE


def is_equirectangular(greys: Sequence[NDArray[np.uint8]]) -> bool:
    """Whether pictures of one camera are equirectangular, by what they show.

    Args:
        greys: (H, W) a few of them.
    """
    if not greys or not is_two_to_one(greys[0].shape[1], greys[0].shape[0]):
        return False
    if is_dual_fisheye(greys):
        return False
    shares = np.median([_shares(grey.astype(np.float64)) for grey in greys], axis=0)
    return bool(shares[0] <= MAX_EDGE_SHARE and shares[1] <= MAX_POLE_SHARE)


def is_dual_fisheye(greys: Sequence[NDArray[np.uint8]]) -> bool:
    """Whether pictures hold two fisheye circles side by side, dark around them."""
    if not greys or not is_two_to_one(greys[0].shape[1], greys[0].shape[0]):
        return False
    return bool(np.median([_is_two_circles(grey) for grey in greys]))


def flat_views(width: int, height: int) -> tuple[FlatView, ...]:
    """A closed ring of level views that overlap by a third, at the picture's own resolution."""
    size = max(16, 2 * round(width / (2 * math.pi)))
    focal = size / 2 / math.tan(FIELD_OF_VIEW / 2)
    at = np.arange(size) + 0.5 - size / 2
    x, y = np.meshgrid(at / focal, at / focal)
    down = np.arctan2(y, np.hypot(x, 1.0))
    rows = (down / math.pi + 0.5) * height - 0.5
    views: list[FlatView] = []
    for number in range(VIEWS):
        yaw = np.arctan2(x, 1.0) + 2 * math.pi * number / VIEWS
        columns = (yaw / (2 * math.pi) + 0.5) % 1.0 * width - 0.5
        views.append(
            FlatView(LABELS[number], focal, columns.astype(np.float32), rows.astype(np.float32))
        )
    return tuple(views)


def cut(picture: NDArray[np.uint8], view: FlatView) -> NDArray[np.uint8]:
    """A view's picture, (S, S, 3)."""
    flat = cv2.remap(picture, view.columns, view.rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(flat, dtype=np.uint8)


def _shares(grey: NDArray[np.float64]) -> tuple[float, float]:
    height, width = grey.shape
    apart = [np.abs(grey[:, 0] - grey[:, k * width // 8]).mean() for k in range(1, 8)]
    edge = np.abs(grey[:, 0] - grey[:, -1]).mean() / max(float(np.median(apart)), 1e-6)
    contrast = float(grey[height // 2].std())
    if contrast < MIN_CONTRAST:
        return math.inf, math.inf
    return float(edge), max(float(grey[0].std()), float(grey[-1].std())) / contrast


def _is_two_circles(grey: NDArray[np.uint8]) -> bool:
    height, width = grey.shape
    patch = max(2, height // 16)
    half = width // 2
    corners = [
        grey[rows, columns]
        for rows in (slice(0, patch), slice(height - patch, height))
        for columns in (
            slice(0, patch),
            slice(half - patch // 2, half + patch // 2),
            slice(width - patch, width),
        )
    ]
    middles = [
        grey[height // 3 : -height // 3, k * half + half // 3 :][:, : half // 3] for k in (0, 1)
    ]
    return all(part.mean() < DARK for part in corners) and all(
        part.mean() > 2 * DARK for part in middles
    )
