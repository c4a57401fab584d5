"""One solve under one prior: an object that stands is held to its support plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence
from tracking.evidence.rendering import RenderingCache
from tracking.follow.posterior import CONTACT_SIGMA_M, REACHABLE_M
from tracking.follow.track import Task
from tracking.solve.gauss_newton import TRACKING_REACHES, Fit, Prior, solve
from tracking.solve.motion import pose_vector, vector_pose

FAR_OFF_SUPPORT = 2.5
"""Standard deviations of the height prior beyond which a solve is repeated with a firmer prior.
Chosen on the rooms lab and desk."""

FIRMER = 4.0
"""Factor by which that repeated solve tightens the height prior. Chosen on the rooms lab and
desk."""


def attempt(
    task: Task,
    evidence: Evidence,
    cache: RenderingCache,
    world_from_start: Pose,
    prior: Prior,
    *,
    reaches_px: tuple[float, ...],
    slide: bool = False,
) -> Fit:
    """Solve from one start, moved to the height of the prior where that is tight.

    An object that stands is within the uncertainty of its support plane. A contour that lifts it
    farther is biased, so a second solve tightens the height prior.

    Args:
        task: the object and the frame.
        evidence: its window.
        cache: reduced renderings of the object in this window so far.
        world_from_start: start pose.
        prior: of the pose.
        reaches_px: distance from the contour within which edges are searched, round by round.
        slide: whether the rendering is first slid over the picture.
    """

    def solved(world_from_start: Pose, solve_prior: Prior, reaches_px: tuple[float, ...]) -> Fit:
        return solve(
            evidence,
            task.model,
            world_from_start,
            solve_prior,
            task.scene.renderer,
            reaches_px=reaches_px,
            use_texture=task.use_texture,
            slide_first=slide and solve_prior is prior,
            cache=cache,
        )

    vector = pose_vector(world_from_start)
    if prior.sigma[2] > CONTACT_SIGMA_M:
        return solved(world_from_start, prior, reaches_px)
    eye = task.scene.world_from_rig.translation
    height = float(prior.mean[2])
    vector[:3] = _lowered(vector[:3], height, eye)
    fit = solved(vector_pose(vector), prior, reaches_px)
    vector = pose_vector(fit.world_from_object)
    if abs(vector[2] - height) < FAR_OFF_SUPPORT * prior.sigma[2]:
        return fit
    vector[:3] = _lowered(vector[:3], height, eye)
    firm = replace(prior, sigma=prior.sigma * np.array([1.0, 1.0, 1.0 / FIRMER, 1.0]))
    return solved(vector_pose(vector), firm, TRACKING_REACHES)


def _lowered(
    place: NDArray[np.float64], height_m: float, eye: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A position at another height on the same line of sight, or straight below if that is far."""
    sight = place - eye
    share = (height_m - place[2]) / sight[2] if abs(sight[2]) > 1e-6 else 0.0
    step = share * sight
    if float(np.linalg.norm(step)) > REACHABLE_M:
        step = np.array([0.0, 0.0, height_m - place[2]])
    return place + step
