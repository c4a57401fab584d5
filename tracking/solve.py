"""Pose of one object in one crop: robust Gauss-Newton on contour, texture and prior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, wrap_angle
from scenes.render.renderer import Renderer, Rendering
from tracking.align import detail, slide
from tracking.contour import Contour, Texture, contour_points, texture_points
from tracking.evidence import Evidence
from tracking.metrics import ROUND
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.observe import Edges, Rows, measure_contour, measure_texture
from tracking.pictures import blurred
from tracking.smooth import pose_vector, vector_pose

Points = NDArray[np.float64]

CONTOUR_POINTS = 260
TEXTURE_POINTS = 500
LEAST_SLOPE = 0.012
TEXTURE_BLUR_PX = 0.8
AGREE_PX = 1.6
"""An edge this near to the drawn one agrees with the pose."""

GROUNDED_M = 0.015
"""A height prior at least this tight means that the object stands on something."""

FINE_REACH_PX = 4.5
"""Texture takes part from rounds with at most this reach."""

TEXTURE_CUTOFF = 3.0
"""Tukey's constant for texture, in standard deviations."""

HALO_M = 0.0025
HALO_SIGMA_M = 0.0015
"""Splats reach past the surface they stand for; how far is measured with the pose (5th unknown)."""

LOW_PASS_PX = 0.4
"""The renderer's low-pass filter and the alpha of overlapping splats widen a silhouette by this."""

ROUND_YAW_SIGMA = 3.0
"""Radians: what is reported for the yaw of a round object."""


TEXTURED_SHARE = 0.8
PLAIN_SHARE = 0.3
"""How much of a pose's quality is likeness, the rest being the contour's agreement."""


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is known before looking.

    Attributes:
        mean: (4,) x, y, z, yaw.
        sigma: (4,) standard deviations, metres and radians.
        halo_m: how far the drawn surface is believed to lie outside the real one.
        halo_sigma_m: standard deviation of that.
    """

    mean: Points
    sigma: Points
    halo_m: float = HALO_M
    halo_sigma_m: float = HALO_SIGMA_M


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose and how well the picture supports it.

    Attributes:
        world_from_object: `world_from_object`.
        covariance: (4, 4) of x, y, z, yaw.
        agreement: 0..1, share of the contour whose edge was seen where it was drawn.
        visible_fraction: 0..1, share of the drawn silhouette that shows the object.
        covered_fraction: 0..1, share of the silhouette that shows something else in front.
        halo_m: how far the drawn contour lies outside the seen one, at the object's distance.
        halo_sigma_m: standard deviation of that.
        likeness: -1..1, correlation of the drawn colours with the live ones.
        textured: whether that likeness must be high.
        drawn: the object at the pose.
    """

    world_from_object: Pose
    covariance: Points
    agreement: float
    visible_fraction: float
    covered_fraction: float
    halo_m: float
    halo_sigma_m: float
    likeness: float
    textured: bool
    drawn: Rendering

    @property
    def quality(self) -> float:
        """0..1: ranks poses of one object in one picture against each other."""
        share = TEXTURED_SHARE if self.textured else PLAIN_SHARE
        return self.agreement * (1.0 - share + share * max(self.likeness, 0.0))


TRACKING_REACHES = (9.0, 4.0, 2.5)
"""Search distances in pixels of the rounds of a frame-to-frame solve."""

SLID_REACHES = (4.5, 3.0, 2.5)
"""The same after a textured object was slid onto its picture."""

COLD_REACHES = (16.0, 10.0, 5.0, 2.5)
"""The same for a pose that is only roughly known."""


def solve(
    evidence: Evidence,
    model: TrackModel,
    start_world_from_object: Pose,
    prior: Prior,
    renderer: Renderer,
    *,
    reaches_px: Sequence[float] = TRACKING_REACHES,
    use_texture: bool = True,
    slide_first: bool = False,
) -> Fit:
    """Refine a pose: each round draws the object once and takes a few steps.

    Args:
        evidence: what the crop shows.
        model: the object.
        start_world_from_object: pose to begin with.
        prior: soft knowledge, such as the support plane.
        renderer: draws the object.
        reaches_px: how far from the drawn contour edges are looked for, one per round.
        use_texture: whether the object's inner colours take part.
        slide_first: begin by sliding the silhouette to where it covers most.
    """
    world_from_object, halo_m = start_world_from_object, prior.halo_m
    information = np.diag(1.0 / np.append(prior.sigma, prior.halo_sigma_m) ** 2)
    smooth_live = blurred(evidence.live, TEXTURE_BLUR_PX)
    for reach in reaches_px:
        drawn = draw(model, world_from_object, evidence, renderer)
        if float(drawn.alpha.max()) < 0.5:
            break
        if slide_first and reach == reaches_px[0]:
            world_from_object = slide(
                world_from_object, drawn, evidence, model, grounded=prior.sigma[2] < GROUNDED_M
            )
            drawn = draw(model, world_from_object, evidence, renderer)
        contour, texture = _features(drawn, evidence, world_from_object, use_texture=use_texture)
        for _ in range(3 if reach <= 4 else 2):
            px_per_m = _px_per_m(evidence, model, world_from_object)
            edges = measure_contour(
                evidence,
                contour,
                world_from_object,
                reach_px=reach,
                offset_px=LOW_PASS_PX + halo_m * px_per_m,
            )
            inner = None
            if texture is not None and len(texture) >= 12 and reach <= FINE_REACH_PX:
                inner = measure_texture(
                    evidence, smooth_live, texture, world_from_object, textured=model.textured
                )
            step, information = _step(
                edges, inner, reach, prior, world_from_object, halo_m, px_per_m
            )
            if model.symmetry == ROUND:
                step[3] = 0.0
            world_from_object = vector_pose(pose_vector(world_from_object) + step[:4])
            halo_m += float(step[4])
            if np.abs(step[:3]).max() < 2e-4 and abs(step[3]) < 5e-4:
                break
    return judge(evidence, model, world_from_object, information, renderer, halo_m=halo_m)


def draw(
    model: TrackModel, world_from_object: Pose, evidence: Evidence, renderer: Renderer
) -> Rendering:
    """The object alone, as the crop's camera would see it."""
    return renderer.render(
        (model.splats_at(world_from_object),),
        evidence.camera,
        evidence.world_from_camera,
        RENDER_OPTIONS,
    )


def judge(
    evidence: Evidence,
    model: TrackModel,
    world_from_object: Pose,
    information: Points,
    renderer: Renderer,
    *,
    halo_m: float = HALO_M,
) -> Fit:
    """How well the picture supports a pose, without changing it.

    Args:
        evidence: what the crop shows.
        model: the object.
        world_from_object: to be judged.
        information: (5, 5) of x, y, z, yaw and halo.
        renderer: draws the object.
        halo_m: how far the drawn contour lies outside the real one.
    """
    drawn = draw(model, world_from_object, evidence, renderer)
    covariance = np.asarray(np.linalg.inv(information + 1e-9 * np.eye(5)), dtype=np.float64)
    halo_sigma_m = float(np.sqrt(covariance[4, 4]))
    covariance = covariance[:4, :4]
    silhouette = drawn.alpha > 0.5
    area = int(silhouette.sum())
    if area < 12:
        return Fit(
            world_from_object,
            covariance,
            0.0,
            0.0,
            0.0,
            halo_m,
            halo_sigma_m,
            0.0,
            model.textured,
            drawn,
        )
    contour, _ = _features(drawn, evidence, world_from_object, use_texture=False)
    offset_px = LOW_PASS_PX + halo_m * _px_per_m(evidence, model, world_from_object)
    edges = measure_contour(evidence, contour, world_from_object, reach_px=4.0, offset_px=offset_px)
    agrees = edges.found & (np.abs(edges.offset_px) < AGREE_PX) & ~edges.hidden
    shown = evidence.own * (1 - evidence.hidden)
    foreign = np.maximum(evidence.foreground - evidence.own, evidence.hidden)
    return Fit(
        world_from_object,
        _with_symmetry(covariance, model),
        float(agrees.mean()) if len(agrees) else 0.0,
        float((shown[silhouette] > 0.35).mean()),
        float((foreign[silhouette] > 0.5).mean()),
        halo_m,
        halo_sigma_m,
        _correlation(model, drawn, evidence, silhouette),
        model.textured,
        drawn,
    )


def _features(
    drawn: Rendering, evidence: Evidence, world_from_object: Pose, *, use_texture: bool
) -> tuple[Contour, Texture | None]:
    object_from_camera = world_from_object.inverse() @ evidence.world_from_camera
    contour = contour_points(drawn, evidence.camera, object_from_camera, limit=CONTOUR_POINTS)
    if not use_texture:
        return contour, None
    picture = blurred(drawn.rgb, TEXTURE_BLUR_PX)
    texture = texture_points(
        drawn,
        picture,
        evidence.camera,
        object_from_camera,
        limit=TEXTURE_POINTS,
        least_slope=LEAST_SLOPE,
    )
    return contour, texture


def _px_per_m(evidence: Evidence, model: TrackModel, world_from_object: Pose) -> float:
    """Pixels that a metre across the view takes at the object's distance."""
    camera_from_world = evidence.world_from_camera.inverse()
    depth = float((camera_from_world @ model.centre_at(world_from_object))[2])
    return evidence.camera.fx / max(depth, 0.1)


def _step(
    edges: Edges,
    inner: Rows | None,
    reach_px: float,
    prior: Prior,
    world_from_object: Pose,
    halo_m: float,
    px_per_m: float,
) -> tuple[Points, Points]:
    """One robust Gauss-Newton step in (x, y, z, yaw, halo) and the information (5, 5) behind it."""
    information: Points = np.diag(1.0 / np.append(prior.sigma, prior.halo_sigma_m) ** 2)
    apart = np.append(prior.mean - pose_vector(world_from_object), prior.halo_m - halo_m)
    apart[3] = wrap_angle(float(apart[3]))
    right = information @ apart
    # Tukey's cut-off shrinks with the reach, from half of it down to about 2.5 σ.
    cutoff = max(2.5, 1.3 * reach_px)
    # A wider halo puts the drawn edge closer to the seen one: residual = J·step - px_per_m·halo.
    outline = np.column_stack([edges.rows.jacobian, -px_per_m / edges.sigma_px])
    parts = [(outline, edges.rows, cutoff)]
    if inner is not None and len(inner.residual):
        padded = np.column_stack([inner.jacobian, np.zeros(len(inner.residual))])
        parts.append((padded, inner, TEXTURE_CUTOFF))
    for jacobian, rows, limit in parts:
        weight = rows.weight * np.clip(1.0 - (rows.residual / limit) ** 2, 0.0, None) ** 2
        weighted = jacobian * weight[:, None]
        information = information + weighted.T @ jacobian
        right = right + weighted.T @ rows.residual
    step = np.asarray(np.linalg.solve(information + 1e-9 * np.eye(5), right), dtype=np.float64)
    longest = max(float(np.abs(step[:3]).max()) / 0.15, abs(float(step[3])) / 0.35, 1.0)
    return step / longest, information


def _with_symmetry(covariance: Points, model: TrackModel) -> Points:
    if model.symmetry != ROUND:
        return covariance
    covariance = covariance.copy()
    covariance[3, :] = covariance[:, 3] = 0.0
    covariance[3, 3] = ROUND_YAW_SIGMA**2
    return covariance


def _correlation(
    model: TrackModel, drawn: Rendering, evidence: Evidence, silhouette: NDArray[np.bool_]
) -> float:
    """Correlation of drawn and live colours over the part of the silhouette that is shown.

    A pattern is known by its detail; of a plain object only the shading can be compared.
    """
    shown = silhouette & (evidence.own > 0.35) & (evidence.hidden < 0.5)
    if shown.sum() < 20:
        return 0.0
    if model.textured:
        inside = drawn.alpha > 0.5
        first, second = detail(drawn.rgb, inside), detail(evidence.live, inside)
    else:
        first, second = blurred(drawn.rgb, 1.0), blurred(evidence.live, 1.0)
    a, b = first[shown].astype(np.float64), second[shown].astype(np.float64)
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    norm = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / norm if norm > 1e-9 else 0.0
