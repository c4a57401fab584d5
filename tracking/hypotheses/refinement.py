"""What a rough pose of an object comes to, by outline and by colours, and how likely it is."""

from __future__ import annotations

import math

import numpy as np

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Scene
from tracking.evidence.observation import Observation
from tracking.evidence.rendering import RenderingCache, reduced_rendering
from tracking.evidence.surroundings import surroundings_in
from tracking.hypotheses.hypothesis import Hypothesis
from tracking.likelihood.patch_fit import fit_patch_closely, fit_patch_roughly
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.object_model import TrackModel
from tracking.solve.gauss_newton import Fit, Prior, judge, solve
from tracking.solve.motion import pose_vector

START_SIGMA = (0.25, 0.25, 0.003, 0.6)
"""How far off a pose may be before it is refined: metres and radians."""

START_REACHES = (10.0, 5.0, 2.5)
"""Search distances in px from a start: an alignment leaves a tenth of an object."""

PLACED_SIGMA = (0.01, 0.01, 0.003, 0.05)
"""How well colours alone place an object: metres and radians, a pixel across a room."""

OUTLINED_PX = 40.0
"""Radius in px below which a pose is refined by its colours too: an outline of fewer pixels is its
contact shadow's as much as its own."""

ALIGNED_PX = 18.0
"""Radius in px at which a rough pose is aligned: a place of the search's grid, off by an eighth of
the object, is then off by two pixels, what the lens blurs."""


def aligned(
    observation: Observation, model: TrackModel, world_from_rough: Pose, scene: Scene
) -> Pose:
    """A rough pose laid on the picture by the object's colours at a coarse scale."""
    around = surroundings_in(observation, model, scene.renderer)
    return fit_patch_roughly(around, world_from_rough)[0]


def refined(
    scene: Scene,
    model: TrackModel,
    world_from_start: Pose,
    evidence: Evidence,
    observation: Observation,
    *,
    sigma: tuple[float, float, float, float] = START_SIGMA,
    quickly: bool = False,
) -> Hypothesis:
    """What a rough pose comes to: the likeliest of the solved, the colour-fitted and the start.

    It is solved from where it is, and from where its colours lie on the picture. Colours know a
    place better than a yaw, so that place is tried with the yaw of the start, too.

    Args:
        scene: the frame.
        model: the object.
        world_from_start: where to begin.
        evidence: its window.
        observation: of the same window.
        sigma: how far off the start may be, m and rad.
        quickly: draw it no finer than what it is compared with, an object that moves.
    """
    coarsely = coarse(observation, model, world_from_start)
    starts = (world_from_start, aligned(coarsely, model, world_from_start, scene))
    solved = [
        _solved(scene, model, start, evidence, sigma=sigma, quickly=quickly) for start in starts
    ]
    best = max(
        (
            Hypothesis(fit, pose_support(observation, model, fit.world_from_object, scene.renderer))
            for fit in solved
        ),
        key=lambda hypothesis: hypothesis.support.nats,
    )
    others = [world_from_start, Pose(world_from_start.rotation, starts[1].translation)]
    if radius_px(observation, model, world_from_start) < OUTLINED_PX:
        around = surroundings_in(observation, model, scene.renderer)
        others.append(fit_patch_closely(around, world_from_start)[0])
    for pose in others:
        support = pose_support(observation, model, pose, scene.renderer)
        if support.nats > best.support.nats:
            best = Hypothesis(placed(scene, model, evidence, pose), support)
    return best


def _solved(
    scene: Scene,
    model: TrackModel,
    world_from_start: Pose,
    evidence: Evidence,
    *,
    sigma: tuple[float, float, float, float],
    quickly: bool,
) -> Fit:
    return solve(
        evidence,
        model,
        world_from_start,
        Prior(pose_vector(world_from_start), np.array(sigma)),
        scene.renderer,
        reaches_px=START_REACHES,
        cache=RenderingCache(quickly=quickly),
    )


def placed(scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose) -> Fit:
    """Statistics of a pose that colours gave."""
    reduced = reduced_rendering(model, world_from_object, evidence, scene.renderer)
    prior = Prior(pose_vector(world_from_object), np.array(START_SIGMA))
    information = np.diag(1.0 / Prior(prior.mean, np.array(PLACED_SIGMA)).seven() ** 2)
    return judge(evidence, model, world_from_object, information, prior, reduced)


def radius_px(observation: Observation, model: TrackModel, world_from_object: Pose) -> float:
    """Radius of an object in an observation's pixels."""
    eye = observation.world_from_camera.translation
    range_m = float(np.linalg.norm(model.centre_at(world_from_object) - eye))
    return observation.camera.f_px * model.radius_m / max(range_m, model.radius_m)


def coarse(observation: Observation, model: TrackModel, world_from_object: Pose) -> Observation:
    """An observation at which the object is as large as an alignment wants it."""
    times = radius_px(observation, model, world_from_object) / ALIGNED_PX
    return observation.shrunk(max(math.floor(times), 1))
