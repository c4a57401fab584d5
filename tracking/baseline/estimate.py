"""Staged optimiser of the paper: coarse yaw by keypoints, then Chamfer, then a filter (4.4.2)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from scenes.state import ObjectModel
from tracking.baseline.detect import Detection
from tracking.baseline.matcher import Matcher, Matches
from tracking.baseline.rectify import RectifiedView
from tracking.baseline.refine import chamfer, contour_pixels, minimise_chamfer, observe_contour
from tracking.baseline.smoothing import Glide, Kalman
from tracking.model.object_model import RENDER_OPTIONS

_CV2: Any = cast(Any, cv2)
"""OpenCV says of no array of its own what it holds."""

YAW_STEP_DEG = 45.0
"""Candidates are 0°, 45°, ... 315° (paper eq. 3)."""

REPROJECTION_PX = 2.0
"""RANSAC threshold (paper)."""


def keypoint_loss(matches: Matches) -> float:
    """`-MatchCount · InlierRatio` with a RANSAC homography of 2 px (paper eq. 2)."""
    count = len(matches.first)
    if count < 4:
        return 0.0
    _, inliers = _CV2.findHomography(
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


UPDATE_NS = 1_000_000_000
"""The paper's budget: one pose per object and second."""

FALSE_MOTION_PX2 = 5.0
"""Chamfer loss of the last pose below which nothing really moved (paper; value not given)."""

WINDOW_SIDES = 1.9
"""The part of the view that is drawn and compared, in sides of the detection box."""


@dataclass(frozen=True, slots=True, eq=False)
class PaperTrack:
    """One object's filter and displayed movement.

    Attributes:
        kalman: after the last update.
        glide: what viewers see.
        updated_ns: frame time of the last estimate, or None before the first.
    """

    kalman: Kalman
    glide: Glide
    updated_ns: int | None


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """A part of the rectified view: a camera with the same rays, and what is seen through it."""

    camera: Pinhole
    world_from_camera: Pose
    image: NDArray[np.uint8]
    mask: NDArray[np.bool_]


def estimate(
    source: ObjectModel,
    track: PaperTrack,
    detection: Detection,
    view: RectifiedView,
    *,
    t_ns: int,
    renderer: Renderer,
    matcher: Matcher,
) -> PaperTrack:
    """Estimate a pose in stages: coarse yaw by keypoints, then Chamfer (paper 4.4.2).

    Args:
        source: the object.
        track: its filter before.
        detection: the object in this frame.
        view: the rectified view.
        t_ns: frame time.
        renderer: draws splats.
        matcher: finds keypoints.
    """
    window = _cut(view, detection)
    observed = observe_contour(window.mask)
    last = track.kalman.pose()
    centre = np.array([0.0, 0.0, 0.5 * source.box_m[2]])

    def pose_of(vector: NDArray[np.float64]) -> Pose:
        beside = np.array([vector[0], vector[1], 0.0])
        middle = window.world_from_camera @ (ray * vector[2] + beside)
        return Pose.from_yaw(float(vector[3]), middle - centre)

    def draw(world_from_object: Pose) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        drawn = renderer.render(
            (PosedSplats(source.splats, world_from_object),),
            window.camera,
            window.world_from_camera,
            RENDER_OPTIONS,
        )
        return np.clip(drawn.rgb * 255.0 + 0.5, 0, 255).astype(np.uint8), drawn.alpha > 0.5

    mask = draw(last)[1]
    if chamfer(contour_pixels(mask), observed) < FALSE_MOTION_PX2:
        return replace(track, updated_ns=t_ns)
    in_camera = window.world_from_camera.inverse() @ (last @ centre)
    depth = float(in_camera[2])
    aim = _box_centre(window.mask) + _centre_beside_box(mask, window.camera, in_camera)
    ray = window.camera.unproject(aim[None])[0]
    ray = ray / ray[2]
    yaw, _ = coarse_yaw(
        np.where(window.mask[..., None], window.image, np.uint8(0)),
        lambda candidate: draw(pose_of(np.array([0.0, 0.0, depth, candidate])))[0],
        matcher,
        fallback=last.yaw(),
    )
    best, _ = minimise_chamfer(
        np.array([0.0, 0.0, depth, yaw]), observed, lambda vector: draw(pose_of(vector))[1]
    )
    kalman = track.kalman.update(pose_of(best))
    glide = Glide(track.glide.at(t_ns), kalman.pose(), t_ns, t_ns + UPDATE_NS)
    return PaperTrack(kalman, glide, t_ns)


def _box_centre(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(2,) centre of a mask's box in pixels."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return 0.5 * np.array([columns[0] + columns[-1] + 1, rows[0] + rows[-1] + 1], dtype=np.float64)


def _centre_beside_box(
    mask: NDArray[np.bool_], camera: Pinhole, in_camera: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(2,) pixels from an object's box centre to its projected centre, as drawn at the last pose.

    At the border of a wide view they differ by more than the 5 cm that x and y may change.
    """
    if not mask.any() or in_camera[2] < 0.1:
        return np.zeros(2)
    pixel = np.array(
        [
            camera.fx * in_camera[0] / in_camera[2] + camera.cx,
            camera.fy * in_camera[1] / in_camera[2] + camera.cy,
        ]
    )
    height, width = mask.shape
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    cut = rows[0] == 0 or columns[0] == 0 or rows[-1] == height - 1 or columns[-1] == width - 1
    return np.zeros(2) if cut else pixel - _box_centre(mask)


def _cut(view: RectifiedView, detection: Detection) -> _Window:
    """The part of the view around a detection, as a camera of its own."""
    height, width = detection.mask.shape
    half = 0.5 * WINDOW_SIDES * float(detection.size_px().max()) + 4.0
    left, top = np.floor(np.clip(detection.centre_px() - half, 0, (width, height))).astype(int)
    right, bottom = np.ceil(np.clip(detection.centre_px() + half, 0, (width, height))).astype(int)
    whole = view.camera
    camera = Pinhole(
        int(right - left),
        int(bottom - top),
        whole.fx,
        whole.fy,
        whole.cx - float(left),
        whole.cy - float(top),
    )
    part = (slice(top, bottom), slice(left, right))
    return _Window(camera, view.world_from_camera, view.image[part], detection.mask[part])
