"""Pose of one object in one crop: robust Gauss-Newton on contour, texture and prior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, wrap_angle
from scenes.render.renderer import Rendering, Renderer
from tracking.contour import Contour, Texture, contour_points, texture_points
from tracking.metrics import ROUND
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.evidence import Evidence
from tracking.observe import Edges, Rows, measure_contour, measure_texture
from tracking.smooth import pose_vector, vector_pose

Points = NDArray[np.float64]

CONTOUR_POINTS = 260
TEXTURE_POINTS = 500
LEAST_SLOPE = 0.012
TEXTURE_BLUR_PX = 0.8
AGREE_PX = 1.6
"""An edge this near to the drawn one agrees with the pose."""

TEXTURE_CUTOFF = 3.0
"""Tukey's constant for texture, in standard deviations."""

ROUND_YAW_SIGMA = 3.0
"""Radians: what is reported for the yaw of a round object."""


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is known before looking.

    Attributes:
        mean: (4,) x, y, z, yaw.
        sigma: (4,) standard deviations, metres and radians.
    """

    mean: Points
    sigma: Points


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose and how well the picture supports it.

    Attributes:
        pose: `world_from_object`.
        covariance: (4, 4) of x, y, z, yaw.
        agreement: 0..1, share of the contour whose edge was seen where it was drawn.
        visible_fraction: 0..1, share of the drawn silhouette that shows the object.
        covered_fraction: 0..1, share of the silhouette that shows something else in front.
        offset_px: median outward distance of the seen contour from the drawn one.
        likeness: -1..1, correlation of the drawn colours with the live ones.
        drawn: the object at the pose.
    """

    pose: Pose
    covariance: Points
    agreement: float
    visible_fraction: float
    covered_fraction: float
    offset_px: float
    likeness: float
    drawn: Rendering

    @property
    def quality(self) -> float:
        """0..1: ranks poses of one object in one picture against each other."""
        return max(0.0, self.agreement) * (0.6 + 0.4 * max(self.likeness, 0.0))


TRACKING_REACHES = (8.0, 4.0, 2.5)
"""Search distances in pixels of the rounds of a frame-to-frame solve."""

COLD_REACHES = (16.0, 10.0, 5.0, 2.5)
"""The same for a pose that is only roughly known."""


def solve(
    evidence: Evidence,
    model: TrackModel,
    start: Pose,
    prior: Prior,
    renderer: Renderer,
    *,
    reaches_px: Sequence[float] = TRACKING_REACHES,
    offset_px: float = 0.0,
    use_texture: bool = True,
) -> Fit:
    """Refine a pose: each round draws the object once and takes a few steps.

    Args:
        evidence: what the crop shows.
        model: the object.
        start: pose to begin with.
        prior: soft knowledge, such as the support plane.
        renderer: draws the object.
        reaches_px: how far from the drawn contour edges are looked for, one per round.
        offset_px: by how much the drawn contour is known to lie outside the real one.
        use_texture: whether the object's inner colours take part.
    """
    pose = start
    information = np.diag(1.0 / prior.sigma**2)
    smooth_live = cv2.GaussianBlur(evidence.live, (0, 0), TEXTURE_BLUR_PX)
    for reach in reaches_px:
        drawn = draw(model, pose, evidence, renderer)
        if float(drawn.alpha.max()) < 0.5:
            break
        contour, texture = _features(drawn, evidence, pose, use_texture=use_texture)
        for _ in range(3 if reach <= 4 else 2):
            rows = _rows(evidence, smooth_live, contour, texture, pose, reach, offset_px)
            step, information = _step(rows, reach, prior, pose, model)
            pose = vector_pose(pose_vector(pose) + step)
            if np.abs(step[:3]).max() < 2e-4 and abs(step[3]) < 5e-4:
                break
    return judge(evidence, model, pose, information, renderer, offset_px=offset_px)


def draw(model: TrackModel, pose: Pose, evidence: Evidence, renderer: Renderer) -> Rendering:
    """The object alone, as the crop's camera would see it."""
    return renderer.render(
        (model.splats_at(pose),), evidence.camera, evidence.world_from_camera, RENDER_OPTIONS
    )


def judge(
    evidence: Evidence,
    model: TrackModel,
    pose: Pose,
    information: Points,
    renderer: Renderer,
    *,
    offset_px: float = 0.0,
) -> Fit:
    """How well the picture supports a pose, without changing it."""
    drawn = draw(model, pose, evidence, renderer)
    covariance = np.linalg.inv(information + 1e-9 * np.eye(4))
    silhouette = drawn.alpha > 0.5
    area = int(silhouette.sum())
    if area < 12:
        return Fit(pose, covariance, 0.0, 0.0, 0.0, 0.0, 0.0, drawn)
    contour, _ = _features(drawn, evidence, pose, use_texture=False)
    edges = measure_contour(evidence, contour, pose, reach_px=4.0, offset_px=offset_px)
    agrees = edges.found & (np.abs(edges.offset_px) < AGREE_PX) & ~edges.hidden
    shown = evidence.own * (1 - evidence.hidden)
    foreign = np.maximum(evidence.foreground - evidence.own, evidence.hidden)
    return Fit(
        pose,
        _with_symmetry(covariance, model),
        float(agrees.mean()) if len(agrees) else 0.0,
        float((shown[silhouette] > 0.35).mean()),
        float((foreign[silhouette] > 0.5).mean()),
        _median_offset(edges),
        _correlation(drawn, evidence, silhouette),
        drawn,
    )


def _features(
    drawn: Rendering, evidence: Evidence, pose: Pose, *, use_texture: bool
) -> tuple[Contour, Texture | None]:
    object_from_camera = pose.inverse() @ evidence.world_from_camera
    contour = contour_points(drawn, evidence.camera, object_from_camera, limit=CONTOUR_POINTS)
    if not use_texture:
        return contour, None
    picture = cv2.GaussianBlur(drawn.rgb, (0, 0), TEXTURE_BLUR_PX)
    texture = texture_points(
        drawn,
        np.asarray(picture, dtype=np.float32),
        evidence.camera,
        object_from_camera,
        limit=TEXTURE_POINTS,
        least_slope=LEAST_SLOPE,
    )
    return contour, texture


def _rows(
    evidence: Evidence,
    smooth_live: NDArray[np.float32],
    contour: Contour,
    texture: Texture | None,
    pose: Pose,
    reach_px: float,
    offset_px: float,
) -> tuple[Rows, Rows | None]:
    edges = measure_contour(evidence, contour, pose, reach_px=reach_px, offset_px=offset_px)
    if texture is None or len(texture) < 12 or reach_px > 4.5:
        return edges.rows, None
    return edges.rows, measure_texture(evidence, smooth_live, texture, pose)


def _step(
    rows: tuple[Rows, Rows | None], reach_px: float, prior: Prior, pose: Pose, model: TrackModel
) -> tuple[Points, Points]:
    """One robust Gauss-Newton step (4,) and the information (4, 4) it came from."""
    information = np.diag(1.0 / prior.sigma**2)
    apart = prior.mean - pose_vector(pose)
    apart[3] = wrap_angle(float(apart[3]))
    right = information @ apart
    contour, texture = rows
    # Tukey's cut-off shrinks with the reach, from half of it down to about 2.5 σ.
    cutoff = max(2.5, 1.3 * reach_px)
    for part, limit in ((contour, cutoff), (texture, TEXTURE_CUTOFF)):
        if part is None or len(part.residual) == 0:
            continue
        weight = part.weight * np.clip(1.0 - (part.residual / limit) ** 2, 0.0, None) ** 2
        weighted = part.jacobian * weight[:, None]
        information = information + weighted.T @ part.jacobian
        right = right + weighted.T @ part.residual
    step = np.linalg.solve(information + 1e-9 * np.eye(4), right)
    if model.symmetry == ROUND:
        step[3] = 0.0
    longest = max(float(np.abs(step[:3]).max()) / 0.15, abs(float(step[3])) / 0.35, 1.0)
    return step / longest, information


def _with_symmetry(covariance: Points, model: TrackModel) -> Points:
    if model.symmetry != ROUND:
        return covariance
    covariance = covariance.copy()
    covariance[3, :] = covariance[:, 3] = 0.0
    covariance[3, 3] = ROUND_YAW_SIGMA**2
    return covariance


def _median_offset(edges: Edges) -> float:
    used = edges.found & ~edges.hidden & (np.abs(edges.offset_px) < 2.5)
    return float(np.median(edges.offset_px[used])) if used.sum() >= 20 else 0.0


def _correlation(
    drawn: Rendering, evidence: Evidence, silhouette: NDArray[np.bool_]
) -> float:
    """Correlation of drawn and live colours over the part of the silhouette that is shown."""
    shown = silhouette & (evidence.own > 0.35) & (evidence.hidden < 0.5)
    if shown.sum() < 20:
        return 0.0
    a = cv2.GaussianBlur(drawn.rgb, (0, 0), 1.0)[shown].astype(np.float64)
    b = cv2.GaussianBlur(evidence.live, (0, 0), 1.0)[shown].astype(np.float64)
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    norm = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / norm if norm > 1e-9 else 0.0
