"""A first, coarse step: slide the drawn object over the picture to where it fits best.

A plain object is slid by its silhouette, a textured one by its picture.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tracking.evidence.evidence import Evidence
from tracking.model.object_model import TrackModel

FloatArray = NDArray[np.float32]

SHRINK = 2
"""Pictures are halved first: this step is worth a pixel or two."""

REACH_SHARE = 0.22
"""The silhouette is slid by at most this share of the crop's side."""

MIN_GAIN = 0.12
"""A slide must cover this much more of the silhouette to be worth it."""

TEMPLATE_BLUR_PX = 0.8
DETAIL_PX = 3.0
MIN_CORRELATION = 0.3
"""A textured object's picture must correlate this well with the live one to be slid there."""

MIN_SHIFT_PX = 3.0
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
    # The object's own pixels vote for a position, the empty room against it, others abstain.
    vote = evidence.own - 0.7 * np.clip(1.0 - evidence.foreground - evidence.hidden, 0.0, 1.0)
    vote = cv2.resize(vote, size, interpolation=cv2.INTER_AREA)
    drawn = cv2.resize(alpha, size, interpolation=cv2.INTER_AREA)
    reach = max(2, int(REACH_SHARE * size[0]))
    framed = cv2.copyMakeBorder(vote, reach, reach, reach, reach, cv2.BORDER_CONSTANT, value=-0.35)
    covered = cv2.matchTemplate(framed, drawn, cv2.TM_CCORR)
    covered = np.asarray(covered, dtype=np.float64) / max(float(drawn.sum()), 1.0)
    offsets = np.arange(-reach, reach + 1) / reach
    cost = 0.1 * (offsets[None, :] ** 2 + offsets[:, None] ** 2)
    row, column = np.unravel_index(np.argmax(covered - cost), covered.shape)
    shift = np.array([column - reach, row - reach], dtype=np.float64) * SHRINK
    gain = float(covered[row, column] - covered[reach, reach])
    if gain < MIN_GAIN or float(np.linalg.norm(shift)) < MIN_SHIFT_PX:
        return None
    return shift


def detail(picture: FloatArray, inside: NDArray[np.bool_]) -> FloatArray:
    """(H, W, 3) fine structure of a picture inside a mask: what a pattern is known by."""
    share = inside.astype(np.float32)[..., None]
    around = cv2.GaussianBlur(share, (0, 0), DETAIL_PX)[..., None] + np.float32(1e-3)
    coarse = cv2.GaussianBlur(picture * share, (0, 0), DETAIL_PX) / around
    fine = cv2.GaussianBlur(picture, (0, 0), TEMPLATE_BLUR_PX)
    return np.asarray((fine - coarse) * share, dtype=np.float32)


def texture_shift(evidence: Evidence, drawn: Rendering) -> tuple[NDArray[np.float64], float] | None:
    """(2,) pixels by which the drawn picture should be slid, and its correlation there, -1..1.

    Args:
        evidence: the crop.
        drawn: the object alone; None is returned if nothing of it is in the crop.
    """
    rows = np.flatnonzero((drawn.alpha > 0.5).any(axis=1))
    columns = np.flatnonzero((drawn.alpha > 0.5).any(axis=0))
    if len(rows) < 4 or len(columns) < 4:
        return None
    part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    inside = drawn.alpha > 0.5
    picture = detail(drawn.rgb, inside)[part]
    live = detail(evidence.live, np.ones_like(inside))
    mask = np.repeat(inside[part].astype(np.float32)[..., None], 3, axis=2)
    match = cv2.matchTemplate(live, picture, cv2.TM_CCOEFF_NORMED, mask=mask)
    match = np.where(np.isfinite(match) & (np.abs(match) <= 1.0), match, -1.0)
    y, x = np.mgrid[0 : match.shape[0], 0 : match.shape[1]].astype(np.float64)
    apart = np.hypot(x - columns[0], y - rows[0]) / max(match.shape)
    row, column = np.unravel_index(np.argmax(match - 0.1 * apart**2), match.shape)
    shift = np.array([column - columns[0], row - rows[0]], dtype=np.float64)
    return shift, float(match[row, column])


def slide(
    world_from_object: Pose,
    drawn: Rendering,
    evidence: Evidence,
    model: TrackModel,
    *,
    grounded: bool,
) -> Pose:
    """The pose whose picture fits the crop best without turning or scaling it.

    Args:
        world_from_object: before.
        drawn: the object at that pose.
        evidence: the crop.
        model: the object.
        grounded: slide along the support plane; otherwise at the same distance from the camera.
    """
    if model.textured:
        found = texture_shift(evidence, drawn)
        if found is not None and found[1] > MIN_CORRELATION:
            return shifted(world_from_object, found[0], evidence, model, grounded=grounded)
    shift = silhouette_shift(evidence, drawn.alpha)
    if shift is None:
        return world_from_object
    return shifted(world_from_object, shift, evidence, model, grounded=grounded)


def shifted(
    world_from_object: Pose,
    shift_px: NDArray[np.float64],
    evidence: Evidence,
    model: TrackModel,
    *,
    grounded: bool,
) -> Pose:
    """The pose whose picture is slid by `shift_px`.

    Args:
        world_from_object: before.
        shift_px: (2,) pixels.
        evidence: the crop, for its camera.
        model: the object.
        grounded: slide along the support plane; otherwise at the same distance from the camera.
    """
    camera, world_from_camera = evidence.camera, evidence.world_from_camera
    camera_from_world = world_from_camera.inverse()
    anchor = world_from_object.translation if grounded else model.centre_at(world_from_object)
    pixel, _ = camera.project((camera_from_world @ anchor)[None])
    ray = world_from_camera.rotation @ camera.unproject(pixel + shift_px)[0]
    eye = world_from_camera.translation
    if grounded and ray[2] < -0.02:
        place = eye + ray * ((anchor[2] - eye[2]) / ray[2])
    else:
        place = eye + ray * float(np.linalg.norm(anchor - eye))
    step = place - anchor
    length = float(np.linalg.norm(step))
    if length > STEEPEST_M:
        step = step * (STEEPEST_M / length)
    return Pose(world_from_object.rotation, world_from_object.translation + step)
