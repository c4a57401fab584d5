# pyright: standard
"""Coarse yaw of the paper's optimiser: the candidate with the best keypoint matches."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tracking.baseline.matcher import Matcher, Matches

YAW_STEP_DEG = 45.0
"""Candidates are 0°, 45°, ... 315° (paper eq. 3)."""

REPROJECTION_PX = 2.0
"""RANSAC threshold (paper)."""


def keypoint_loss(matches: Matches) -> float:
    """`-MatchCount · InlierRatio` with a RANSAC homography of 2 px (paper eq. 2)."""
    count = len(matches.first)
    if count < 4:
        return 0.0
    _, inliers = cv2.findHomography(
        matches.first.astype(np.float32),
        matches.second.astype(np.float32),
        cv2.RANSAC,
        REPROJECTION_PX,
    )
    return -count * float(inliers.mean()) if inliers is not None else 0.0


def coarse_yaw(
    observed: NDArray[np.uint8],
    draw: Callable[[float], NDArray[np.uint8]],
    matcher: Matcher,
    *,
    fallback: float,
) -> tuple[float, Sequence[float]]:
    """The candidate yaw with the lowest keypoint loss (paper eq. 3), and all losses.

    Args:
        observed: (H, W, 3) the object cut out of the live picture.
        draw: draws the object at a yaw in radians, into a picture of the same size.
        matcher: finds the keypoints.
        fallback: yaw in radians to keep when no candidate has a single verified match.
    """
    step = math.radians(YAW_STEP_DEG)
    candidates = [k * step for k in range(round(2 * math.pi / step))]
    losses = [keypoint_loss(matcher.match(observed, draw(yaw))) for yaw in candidates]
    if min(losses) >= 0.0:
        return fallback, losses
    return candidates[int(np.argmin(losses))], losses
