# pyright: standard
"""How good a picture is for reconstruction: sharp, lit, with something to see, and how it moved."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

GreyPicture = NDArray[np.uint8]

LOOK_PX = 640
"""Longest side at which pictures are judged, so that a camera's resolution does not matter."""
REBLUR_TAPS = 9
"""Taps of the box filter that a picture is blurred by again (Crete et al. 2007)."""
FLOW_PX = 320
"""Size at which points are followed, px."""
CORNERS = 200
"""Corners that are followed at most."""
MIN_TRACKS = 12
"""Corners followed below which motion is not known."""
AGREE_PX = 1.0
"""A corner tracked there and back again ends where it began."""


class Reason(StrEnum):
    """Why a picture is not used."""

    UNREADABLE = "not readable"
    MISSING = "missing or not fitting its pose"
    SPHERICAL = "360° pictures"
    FOREIGN = "of a kind that is not read"
    DARK = "too dark"
    EMPTY = "without detail"
    BLURRED = "blurred"
    ALIKE = "too like its neighbour"


@dataclass(frozen=True, slots=True)
class Quality:
    """Measured quality of a single picture.

    Attributes:
        brightness: mean grey level, 0..255.
        detail: standard deviation of the grey level within 8 px patches, in the liveliest percent
            of them: a code on a bare wall is enough.
        blur: 0 (crisp) .. 1 (no detail left), hardly dependent on what the picture shows.
    """

    brightness: float
    detail: float
    blur: float


@dataclass(frozen=True, slots=True)
class QualityLimits:
    """When a picture is refused.

    Attributes:
        darkest: mean grey level, 0..255.
        least_detail: grey levels.
        blurriest: of any picture.
        blur_over_typical: how much more blurred than the capture's median it may be.
    """

    darkest: float = 14.0
    least_detail: float = 6.0
    blurriest: float = 0.72
    blur_over_typical: float = 0.16


def shrunk(grey: GreyPicture, longest_px: int) -> GreyPicture:
    """The picture with its longest side at most `longest_px`."""
    height, width = grey.shape
    scale = longest_px / max(height, width)
    if scale >= 1:
        return grey
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def judge(grey: GreyPicture) -> Quality:
    """The quality of a picture; (H, W) uint8.

    Blur compares the picture's own gradients with those after another blur (Crété-Roffet et al.
    2007, "The blur effect"): a crisp picture loses most of them, a blurred one hardly any. The
    worse of the two directions counts, because a moving camera blurs in one direction only.
    """
    picture = shrunk(grey, LOOK_PX).astype(np.float32)
    return Quality(
        brightness=float(picture.mean()),
        detail=_detail(picture),
        blur=max(_blur_along(picture, axis) for axis in (0, 1)),
    )


def verdict(quality: Quality, typical_blur: float, limits: QualityLimits) -> Reason | None:
    """Why a picture is not good enough, or None."""
    if quality.brightness < limits.darkest:
        return Reason.DARK
    if quality.detail < limits.least_detail:
        return Reason.EMPTY
    if quality.blur > min(limits.blurriest, typical_blur + limits.blur_over_typical):
        return Reason.BLURRED
    return None


def displacement(before: GreyPicture, after: GreyPicture) -> float:
    """How far the picture moved, as a fraction of its width; 1 if nothing is found again.

    The upper quartile of tracked corners (Lucas-Kanade, there and back): walking ahead hardly
    moves the middle.
    """
    a, b = shrunk(before, FLOW_PX), shrunk(after, FLOW_PX)
    if a.shape != b.shape:
        return 1.0
    corners = cv2.goodFeaturesToTrack(a, CORNERS, 0.01, 6)
    if corners is None or len(corners) < MIN_TRACKS:
        return 1.0
    corners = corners.reshape(-1, 2).astype(np.float32)
    moved, found = _track(a, b, corners)
    back, found_back = _track(b, a, moved)
    kept = found & found_back & (np.linalg.norm(back - corners, axis=1) < AGREE_PX)
    if kept.sum() < max(MIN_TRACKS, len(corners) // 5):
        return 1.0
    steps = np.linalg.norm(moved - corners, axis=1)[kept]
    return min(1.0, float(np.quantile(steps, 0.75)) / a.shape[1])


def _track(
    before: GreyPicture, after: GreyPicture, points: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    moved, found, _ = cv2.calcOpticalFlowPyrLK(  # pyright: ignore[reportCallIssue]
        before,
        after,
        points[:, None],
        None,  # pyright: ignore[reportArgumentType]
        winSize=(15, 15),
        maxLevel=4,
    )
    return moved.reshape(-1, 2), found.ravel() > 0


def _detail(picture: NDArray[np.float32]) -> float:
    mean = cv2.blur(picture, (8, 8))
    spread = np.sqrt(np.maximum(cv2.blur(picture * picture, (8, 8)) - mean * mean, 0.0))
    return float(np.quantile(spread[::8, ::8], 0.99))


def _blur_along(picture: NDArray[np.float32], axis: int) -> float:
    kernel = (1, REBLUR_TAPS) if axis == 0 else (REBLUR_TAPS, 1)
    sharp = np.abs(np.diff(picture, axis=axis))
    soft = np.abs(np.diff(cv2.blur(picture, kernel), axis=axis))
    total = float(sharp.sum())
    if total <= 0:
        return 1.0
    return 1.0 - float(np.maximum(sharp - soft, 0.0).sum()) / total
