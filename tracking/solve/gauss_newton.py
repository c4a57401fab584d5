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
from tracking.evidence.rendering import LEAST_AREA_PX, ROUGHLY, Sketch, Sketchbook
from tracking.likelihood.contour_support import NOTHING_DRAWN
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.solve.measurement import Measurement, judged, refined
from tracking.solve.motion import pose_vector, vector_pose
from tracking.solve.slide import slide
from tracking.window.contour import Contour, Texture

Points = NDArray[np.float64]

LEAST_VARIANCE = 0.5
"""What a contour's residuals may make of the variance expected of them, however small they are."""

SUPPORT_SIGMA_M = 0.0015
"""How well a scan knows the height of a support, and of what stands on it."""

GROUNDED_M = 0.015
"""A height prior at least this tight means that the object stands on something."""

FINE_REACH_PX = 4.5
"""Texture takes part from rounds with at most this reach."""

ROUGH_POINTS = 80
"""Of the outline, in the rounds before."""

LEAST_TEXTURE = 12

LEVEL_SIGMA_RAD = 1e-5
"""Objects are upright: the tilt's standard deviation."""

LOW_PASS_PX = 0.4
"""The renderer's low-pass filter and the alpha of overlapping splats widen a silhouette by this."""

HALO_M = 0.0025
HALO_SIGMA_M = 0.0015
"""Splats reach past the surface they stand for; how far is measured with the pose (7th unknown)."""

ROUND_YAW_SIGMA = 3.0
"""Radians: what is reported for the yaw of a round object."""

TEXTURED_SHARE = 0.8
PLAIN_SHARE = 0.5
"""How much of a pose's quality is likeness, the rest being the contour's agreement."""

UPRIGHT = [0, 1, 2, 5, 6]
"""Unknowns of an upright object among shift, turn and halo."""


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

    def weights(self) -> Points:
        """(7,) information of shift, turn and halo."""
        return 1.0 / self.seven() ** 2

    def seven(self) -> Points:
        """(7,) standard deviations of shift, turn and halo."""
        x, y, z, yaw = self.sigma
        level = LEVEL_SIGMA_RAD
        return np.array([x, y, z, level, level, yaw, self.halo_sigma_m])


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose and how well the picture supports it.

    Attributes:
        world_from_object: `world_from_object`.
        covariance: (4, 4) of x, y, z, yaw, from the picture's noise alone.
        response: (4, 6) how x, y, z and yaw follow when all that is seen shifts and turns.
        agreement: 0..1, share of the contour whose edge was seen where it was drawn.
        free_share: 0..1, share of the contour that nothing is in front of.
        misfit: sum of the contour's squared residuals in standard deviations, robust; where there
            is no edge, as large as they count at most.
        alike: at least 1, by how much less the contour's points say than is taken for granted in a
            solve, because neighbours err alike.
        visible_fraction: 0..1, share of the drawn silhouette that shows the object.
        covered_fraction: 0..1, share of the silhouette that shows something else in front.
        halo_m: how far the drawn contour lies outside the seen one, at the object's distance.
        halo_sigma_m: standard deviation of that.
        likeness: -1..1, correlation of the drawn colours with the live ones.
        textured: whether that likeness must be high.
        sketch: the object as it was drawn near the pose.
    """

    world_from_object: Pose
    covariance: Points
    response: Points
    agreement: float
    free_share: float
    misfit: float
    alike: float
    visible_fraction: float
    covered_fraction: float
    halo_m: float
    halo_sigma_m: float
    likeness: float
    textured: bool
    sketch: Sketch

    @property
    def free_agreement(self) -> float:
        """0..1: share of the free contour whose edge was seen where it was drawn."""
        return self.agreement / max(self.free_share, 1e-6)

    @property
    def support(self) -> float:
        """0..1: agreement of the free contour, less sure the less of it there is.

        A share of n points is uncertain by 1/√n: a short piece of an outline fits in many places by
        chance.
        """
        return self.agreement / math.sqrt(max(self.free_share, 1e-6))

    @property
    def quality(self) -> float:
        """0..1: ranks poses of one object in one picture against each other."""
        share = TEXTURED_SHARE if self.textured else PLAIN_SHARE
        return self.support * (1.0 - share + share * max(self.likeness, 0.0))


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
    book: Sketchbook | None = None,
) -> Fit:
    """Refine a pose: the object is drawn only where its sketch no longer serves.

    Args:
        evidence: what the window shows.
        model: the object.
        start_world_from_object: pose to begin with.
        prior: soft knowledge, such as the support plane.
        renderer: draws the object.
        reaches_px: how far from the drawn contour edges are looked for, one per round.
        use_texture: whether the object's inner colours take part.
        slide_first: begin by sliding the silhouette to where it covers most.
        book: what was drawn before of this object in this window, and will be now.
    """
    world_from_object, halo_m = start_world_from_object, prior.halo_m
    book = book or Sketchbook()
    if slide_first:
        drawn = book.drawn(model, world_from_object, evidence, renderer)
        world_from_object = slide(
            world_from_object, drawn, evidence, model, grounded=prior.sigma[2] < GROUNDED_M
        )
    sketch = book.at(model, world_from_object, evidence, renderer, tolerance=ROUGHLY)
    information = np.diag(prior.weights())
    coarse = [(reach, 2) for reach in reaches_px if reach > FINE_REACH_PX]
    fine = [(reach, 3) for reach in reaches_px if reach <= FINE_REACH_PX]
    for rounds in (coarse[:1], coarse[1:], fine):
        if not rounds or sketch.area_px < LEAST_AREA_PX:
            continue
        closely = 1.0 if rounds is fine else ROUGHLY
        sketch = book.at(model, world_from_object, evidence, renderer, tolerance=closely)
        is_fine = rounds is fine
        outline = sketch.contour if is_fine else roughly(sketch.contour)
        texture = sketch.texture if is_fine and use_texture else None
        measurement = _measurement(evidence, model, prior, sketch, outline=outline, texture=texture)
        world_from_object, halo_m, information = refined(
            evidence.seen, measurement, world_from_object, halo_m, rounds=rounds
        )
        world_from_object = vector_pose(pose_vector(world_from_object))
    return judge(evidence, model, world_from_object, information, prior, sketch, halo_m=halo_m)


def roughly(outline: Contour) -> Contour:
    """As much of an outline as tells about where an object is."""
    return outline.thinned(max(len(outline) // ROUGH_POINTS, 1))


def _measurement(
    evidence: Evidence,
    model: TrackModel,
    prior: Prior,
    sketch: Sketch,
    *,
    outline: Contour,
    texture: Texture | None,
) -> Measurement:
    has_texture = texture is not None and len(texture) >= LEAST_TEXTURE
    return Measurement(
        camera=evidence.camera,
        world_from_camera=evidence.world_from_camera,
        outline=outline,
        texture=texture if has_texture else None,
        textured=model.textured,
        centre_m=model.centre_m,
        prior_world_from_object=vector_pose(prior.mean),
        prior_sigma=prior.seven(),
        prior_halo_m=prior.halo_m,
        low_pass_px=LOW_PASS_PX / sketch.finer,
        is_round=model.symmetry == ROUND,
    )


def judge(
    evidence: Evidence,
    model: TrackModel,
    world_from_object: Pose,
    information: Points,
    prior: Prior,
    sketch: Sketch,
    *,
    halo_m: float = HALO_M,
) -> Fit:
    """How well the picture supports a pose, without changing it.

    Args:
        evidence: what the window shows.
        model: the object.
        world_from_object: to be judged.
        information: (7, 7) of shift, turn and halo.
        prior: what was known before looking, a part of that.
        sketch: the object drawn near the pose.
        halo_m: how far the drawn contour lies outside the real one.
    """
    inverse = np.linalg.inv(information + 1e-9 * np.eye(len(information)))
    response = inverse @ (information - np.diag(prior.weights()))
    covariance = (inverse @ _spread(information, prior) @ inverse.T)[np.ix_(UPRIGHT, UPRIGHT)]
    found = NOTHING_DRAWN
    if sketch.area_px >= LEAST_AREA_PX:
        here = Prior(pose_vector(world_from_object), np.ones(4))
        outline = _measurement(evidence, model, here, sketch, outline=sketch.contour, texture=None)
        found = judged(
            evidence.seen,
            outline,
            world_from_object,
            halo_m,
            surface=sketch.surface,
            colours=sketch.colours,
        )
    # Residuals tell what noise and the model's faults come to in this picture.
    variance = max(found.roughness, LEAST_VARIANCE) * found.alike
    return Fit(
        world_from_object=world_from_object,
        covariance=_with_symmetry(covariance[:4, :4] * variance, model),
        response=response[np.ix_(UPRIGHT[:4], range(6))],
        agreement=found.agreement,
        free_share=found.free_share,
        misfit=found.misfit,
        alike=found.alike,
        visible_fraction=found.visible,
        covered_fraction=found.covered,
        halo_m=halo_m,
        halo_sigma_m=float(np.sqrt(covariance[4, 4])),
        likeness=found.likeness,
        textured=model.textured,
        sketch=sketch,
    )


def _spread(information: Points, prior: Prior) -> Points:
    """(7, 7) covariance of what a solve's step was made of; its information if all was believed.

    A support is believed less in a solve than it is known, so that no height is forced upon a scan.
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
