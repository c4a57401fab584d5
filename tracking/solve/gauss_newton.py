"""Pose of one object in one window: robust Gauss-Newton on contour, texture and prior."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from tracking.evidence.evidence import Evidence
from tracking.evidence.rendering import MIN_AREA_PX, ROUGHLY, ReducedRendering, RenderingCache
from tracking.likelihood.contour_support import NOTHING_DRAWN
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.solve.measurement import Measurement, judged, refined
from tracking.solve.motion import pose_vector, vector_pose
from tracking.solve.slide import slide
from tracking.window.contour import Contour, Texture

Points = NDArray[np.float64]

MIN_VARIANCE = 0.5
"""Least factor of a contour's expected variance, however small its residuals are."""

SUPPORT_SIGMA_M = 0.0015
"""How well a scan knows the height of a support, and of what stands on it."""

GROUNDED_M = 0.015
"""A height prior at least this tight means that the object stands on something."""

FINE_REACH_PX = 4.5
"""Texture takes part from rounds with at most this reach."""

ROUGH_POINTS = 80
"""Of the outline, in the rounds before."""

MIN_TEXTURE = 12

LEVEL_SIGMA_RAD = 1e-5
"""Objects are upright: the tilt's standard deviation."""

LOW_PASS_PX = 0.4
"""The renderer's low-pass filter and the alpha of overlapping splats widen a silhouette by this."""

SILHOUETTE_BIAS_M = 0.0025
"""Prior mean of the silhouette bias in m: splats extend past the surface they represent. Estimated
with the pose (7th unknown)."""

SILHOUETTE_BIAS_SIGMA_M = 0.0015
"""Prior standard deviation of the silhouette bias in m."""


ROUND_YAW_SIGMA = 3.0
"""Radians: what is reported for the yaw of a round object."""

TEXTURED_SHARE = 0.8
"""Weight of the colour correlation in a textured object's score; the rest is the contour score."""

PLAIN_SHARE = 0.5
"""The same of a plain object."""


UPRIGHT = [0, 1, 2, 5, 6]
"""Indices of an upright object's unknowns among shift, turn and silhouette bias."""


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """Gaussian prior of a pose and its silhouette bias.

    Attributes:
        mean: (4,) x, y, z (m), yaw (rad).
        sigma: (4,) standard deviations.
        silhouette_bias_m: mean of the silhouette bias.
        silhouette_bias_sigma_m: standard deviation of that.
    """

    mean: Points
    sigma: Points
    silhouette_bias_m: float = SILHOUETTE_BIAS_M
    silhouette_bias_sigma_m: float = SILHOUETTE_BIAS_SIGMA_M

    def weights(self) -> Points:
        """(7,) information of shift, turn and silhouette bias."""
        return 1.0 / self.seven() ** 2

    def seven(self) -> Points:
        """(7,) standard deviations of shift (m), turn (rad) and silhouette bias (m)."""
        x, y, z, yaw = self.sigma
        level = LEVEL_SIGMA_RAD
        return np.array([x, y, z, level, level, yaw, self.silhouette_bias_sigma_m])


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose and its goodness of fit in one window.

    Attributes:
        world_from_object: the pose.
        covariance: (4, 4) of x, y, z (m) and yaw (rad), from the picture's noise alone.
        response: (4, 6) derivative of x, y, z, yaw by a rigid shift (m) and turn (rad) of all that
            is seen.
        edge_inlier_ratio: 0..1, share of the contour points whose edge was found where it was
            rendered.
        unoccluded_ratio: 0..1, share of the contour points that nothing occludes.
        contour_chi2: sum of the squared contour residuals in standard deviations, robust; a point
            without an edge counts the maximum.
        variance_inflation: >= 1, factor by which correlation of neighbouring residuals inflates the
            variance.
        visible_fraction: 0..1, share of the rendered silhouette that shows the object.
        covered_fraction: 0..1, share of the silhouette that shows an occluder.
        silhouette_bias_m: distance of the rendered contour outside the seen one, at the object.
        silhouette_bias_sigma_m: standard deviation of that.
        colour_correlation: -1..1, correlation of the rendered colours with the live ones.
        textured: whether the object is textured, so that the correlation must be high.
        reduced: the object as rendered near the pose.
    """

    world_from_object: Pose
    covariance: Points
    response: Points
    edge_inlier_ratio: float
    unoccluded_ratio: float
    contour_chi2: float
    variance_inflation: float
    visible_fraction: float
    covered_fraction: float
    silhouette_bias_m: float
    silhouette_bias_sigma_m: float
    colour_correlation: float
    textured: bool
    reduced: ReducedRendering

    @property
    def unoccluded_inlier_ratio(self) -> float:
        """0..1: share of the free contour whose edge was seen where it was drawn."""
        return self.edge_inlier_ratio / max(self.unoccluded_ratio, 1e-6)

    @property
    def contour_score(self) -> float:
        """0..1: inlier ratio of the unoccluded contour, lower the less of it there is.

        A ratio of n points is uncertain by 1/√n: a short piece of contour fits in many places by
        chance.
        """
        return self.edge_inlier_ratio / math.sqrt(max(self.unoccluded_ratio, 1e-6))

    @property
    def score(self) -> float:
        """0..1: ranks poses of one object in one picture."""
        share = TEXTURED_SHARE if self.textured else PLAIN_SHARE
        return self.contour_score * (1.0 - share + share * max(self.colour_correlation, 0.0))


TRACKING_REACHES = (9.0, 4.0, 2.5)
"""Search distances in pixels of the rounds of a frame-to-frame solve."""

SLID_REACHES = (4.5, 3.0, 2.5)
"""The same after a textured object was slid onto its picture."""

GROWN_REACHES = (9.0, 4.5, 3.0, 2.5)
"""The same where the pattern lies right and the outline does not: the object came nearer."""

COLD_REACHES = (16.0, 10.0, 5.0, 2.5)
"""The same for a pose that is only roughly known."""


def solve(
    evidence: Evidence,
    model: TrackModel,
    start_world_from_object: Pose,
    prior: Prior,
    renderer: NativeRenderer,
    *,
    reaches_px: Sequence[float] = TRACKING_REACHES,
    use_texture: bool = True,
    slide_first: bool = False,
    cache: RenderingCache | None = None,
) -> Fit:
    """Refine a pose by robust Gauss-Newton; render only where no reduced rendering is valid.

    Args:
        evidence: the window.
        model: the object.
        start_world_from_object: start pose.
        prior: of the pose.
        renderer: renders the object.
        reaches_px: distance from the contour within which edges are searched, one per round.
        use_texture: whether the object's inner colours take part.
        slide_first: begin by sliding the silhouette to where it covers most.
        cache: reduced renderings of the object in this window; extended.
    """
    world_from_object, silhouette_bias_m = start_world_from_object, prior.silhouette_bias_m
    cache = cache or RenderingCache()
    if slide_first:
        drawn = cache.drawn(model, world_from_object, evidence, renderer)
        world_from_object = slide(
            world_from_object, drawn, evidence, model, grounded=prior.sigma[2] < GROUNDED_M
        )
    reduced = cache.at(model, world_from_object, evidence, renderer, tolerance=ROUGHLY)
    information = np.diag(prior.weights())
    coarse = [(reach, 2) for reach in reaches_px if reach > FINE_REACH_PX]
    fine = [(reach, 3) for reach in reaches_px if reach <= FINE_REACH_PX]
    for rounds in (coarse[:1], coarse[1:], fine):
        if not rounds or reduced.area_px < MIN_AREA_PX:
            continue
        closely = 1.0 if rounds is fine else ROUGHLY
        reduced = cache.at(model, world_from_object, evidence, renderer, tolerance=closely)
        is_fine = rounds is fine
        outline = reduced.contour if is_fine else roughly(reduced.contour)
        texture = reduced.texture if is_fine and use_texture else None
        measurement = _measurement(
            evidence, model, prior, reduced, outline=outline, texture=texture
        )
        world_from_object, silhouette_bias_m, information = refined(
            evidence.seen, measurement, world_from_object, silhouette_bias_m, rounds=rounds
        )
        world_from_object = vector_pose(pose_vector(world_from_object))
    return judge(
        evidence,
        model,
        world_from_object,
        information,
        prior,
        reduced,
        silhouette_bias_m=silhouette_bias_m,
    )


def roughly(outline: Contour) -> Contour:
    """A subset of a contour, enough for a coarse pose."""
    return outline.thinned(max(len(outline) // ROUGH_POINTS, 1))


def _measurement(
    evidence: Evidence,
    model: TrackModel,
    prior: Prior,
    reduced: ReducedRendering,
    *,
    outline: Contour,
    texture: Texture | None,
) -> Measurement:
    has_texture = texture is not None and len(texture) >= MIN_TEXTURE
    return Measurement(
        camera=evidence.camera,
        world_from_camera=evidence.world_from_camera,
        outline=outline,
        texture=texture if has_texture else None,
        textured=model.textured,
        centre_m=model.centre_m,
        prior_world_from_object=vector_pose(prior.mean),
        prior_sigma=prior.seven(),
        prior_silhouette_bias_m=prior.silhouette_bias_m,
        low_pass_px=LOW_PASS_PX / reduced.finer,
        is_round=model.symmetry == ROUND,
    )


def judge(
    evidence: Evidence,
    model: TrackModel,
    world_from_object: Pose,
    information: Points,
    prior: Prior,
    reduced: ReducedRendering,
    *,
    silhouette_bias_m: float = SILHOUETTE_BIAS_M,
) -> Fit:
    """Statistics of a pose in a window, without changing it.

    Args:
        evidence: the window.
        model: the object.
        world_from_object: the pose.
        information: (7, 7) of shift, turn and silhouette bias.
        prior: of the solve, a part of that.
        reduced: the object rendered near the pose.
        silhouette_bias_m: distance of the rendered contour outside the real one.
    """
    inverse = np.linalg.inv(information + 1e-9 * np.eye(len(information)))
    response = inverse @ (information - np.diag(prior.weights()))
    covariance = (inverse @ _spread(information, prior) @ inverse.T)[np.ix_(UPRIGHT, UPRIGHT)]
    found = NOTHING_DRAWN
    if reduced.area_px >= MIN_AREA_PX:
        here = Prior(pose_vector(world_from_object), np.ones(4))
        outline = _measurement(
            evidence, model, here, reduced, outline=reduced.contour, texture=None
        )
        found = judged(
            evidence.seen,
            outline,
            world_from_object,
            silhouette_bias_m,
            surface=reduced.surface,
            colours=reduced.colours,
        )
    # Residuals estimate the variance of noise and model errors in this picture.
    variance = max(found.mean_edge_chi2, MIN_VARIANCE) * found.variance_inflation
    return Fit(
        world_from_object=world_from_object,
        covariance=_with_symmetry(covariance[:4, :4] * variance, model),
        response=response[np.ix_(UPRIGHT[:4], range(6))],
        edge_inlier_ratio=found.edge_inlier_ratio,
        unoccluded_ratio=found.unoccluded_ratio,
        contour_chi2=found.contour_chi2,
        variance_inflation=found.variance_inflation,
        visible_fraction=found.visible,
        covered_fraction=found.covered,
        silhouette_bias_m=silhouette_bias_m,
        silhouette_bias_sigma_m=float(np.sqrt(covariance[4, 4])),
        colour_correlation=found.colour_correlation,
        textured=model.textured,
        reduced=reduced,
    )


def _spread(information: Points, prior: Prior) -> Points:
    """(7, 7) covariance of the right-hand side of a solve, from the actual variance of the height.

    A solve weights a support plane less than its accuracy allows, so that no height is forced upon
    a scan.
    """
    spread = information.copy()
    if prior.sigma[2] < GROUNDED_M:
        weight = prior.weights()[2]
        spread[2, 2] += weight * (weight * SUPPORT_SIGMA_M**2 - 1.0)
    return spread


def _with_symmetry(covariance: Points, model: TrackModel) -> Points:
    if model.symmetry != ROUND:
        return covariance
    covariance = covariance.copy()
    covariance[3, :] = covariance[:, 3] = 0.0
    covariance[3, 3] = ROUND_YAW_SIGMA**2
    return covariance
