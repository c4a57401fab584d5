"""A first, coarse step: slide the drawn silhouette over the picture to where it covers most."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence import Evidence
from tracking.model import TrackModel

FloatArray = NDArray[np.float32]

SHRINK = 2
"""Pictures are halved first: this step is worth a pixel or two."""

REACH_SHARE = 0.22
"""The silhouette is slid by at most this share of the crop's side."""

LEAST_GAIN = 0.12
"""A slide must cover this much more of the silhouette to be worth it."""

LEAST_SHIFT_PX = 3.0
STEEPEST_M = 0.6
"""No slide along the support is longer."""


def silhouette_shift(evidence: Evidence, alpha: FloatArray) -> NDArray[np.float64] | None:
    """(2,) pixels by which the silhouette should be slid, or None if it lies well as it is.

    Args:
        evidence: the crop.
        alpha: (H, W) the drawn object.
    """
    height, width = alpha.shape
    size = (width // SHRINK, height // SHRINK)
    # The object's own pixels count for a place, the empty room against it, people and things not.
    vote = evidence.own - 0.7 * np.clip(1.0 - evidence.foreground - evidence.hidden, 0.0, 1.0)
    vote = cv2.resize(vote, size, interpolation=cv2.INTER_AREA)
    drawn = cv2.resize(alpha, size, interpolation=cv2.INTER_AREA)
    reach = max(2, int(REACH_SHARE * size[0]))
    framed = cv2.copyMakeBorder(
        vote, reach, reach, reach, reach, cv2.BORDER_CONSTANT, value=-0.35
    )
    covered = cv2.matchTemplate(framed, drawn, cv2.TM_CCORR)
    covered = np.asarray(covered, dtype=np.float64) / max(float(drawn.sum()), 1.0)
    offsets = np.arange(-reach, reach + 1) / reach
    cost = 0.1 * (offsets[None, :] ** 2 + offsets[:, None] ** 2)
    row, column = np.unravel_index(np.argmax(covered - cost), covered.shape)
    shift = np.array([column - reach, row - reach], dtype=np.float64) * SHRINK
    gain = float(covered[row, column] - covered[reach, reach])
    if gain < LEAST_GAIN or float(np.linalg.norm(shift)) < LEAST_SHIFT_PX:
        return None
    return shift


def shifted(
    pose: Pose,
    shift_px: NDArray[np.float64],
    evidence: Evidence,
    model: TrackModel,
    *,
    grounded: bool,
) -> Pose:
    """The pose whose picture is slid by `shift_px`.

    Args:
        pose: before.
        shift_px: (2,) pixels.
        evidence: the crop, for its camera.
        model: the object.
        grounded: slide along the support plane; otherwise at the same distance from the camera.
    """
    camera, world_from_camera = evidence.camera, evidence.world_from_camera
    camera_from_world = world_from_camera.inverse()
    anchor = pose.translation if grounded else model.centre_at(pose)
    pixel, _ = camera.project((camera_from_world @ anchor)[None])
    ray = world_from_camera.rotation @ camera.unproject(pixel + shift_px)[0]
    eye = world_from_camera.translation
    if grounded and ray[2] < -0.02:
        place = eye + ray * ((anchor[2] - eye[2]) / ray[2])
    else:
        before = anchor - eye
        forward = world_from_camera.rotation[:, 2]
        place = eye + ray * (float(before @ forward) / max(float(ray @ forward), 0.1))
    step = place - anchor
    length = float(np.linalg.norm(step))
    if length > STEEPEST_M:
        step = step * (STEEPEST_M / length)
    return Pose(pose.rotation, pose.translation + step)
