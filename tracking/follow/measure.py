"""Pose of an object in a frame: at the prediction, by relocalisation, or by a local search."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.evidence.appearance_memory import AppearanceMemory
from tracking.evidence.evidence import Evidence, gather, view_of
from tracking.evidence.observation import Observation, observe
from tracking.evidence.rendering import RenderingCache
from tracking.follow.attempt import attempt
from tracking.follow.carried import is_likelier
from tracking.follow.feature_relocalisation import relocalise
from tracking.follow.local_search import Found, log_posterior, search_locally
from tracking.follow.posterior import (
    carried_prior,
    has_left_its_rest,
    is_accepted,
    is_carriable,
    is_conclusive,
    is_heavy,
    min_correlation,
    priors,
    shows_pattern,
)
from tracking.follow.track import Task
from tracking.hypotheses.hypothesis import CLEAR_NATS, apart
from tracking.hypotheses.refinement import CLEAR_SHARE
from tracking.likelihood.pose_likelihood import pose_supports
from tracking.solve.gauss_newton import COLD_REACHES, TRACKING_REACHES, Fit, Prior, judge
from tracking.solve.motion import pose_vector

MOSTLY_COVERED = 0.85
"""Occluded share of the silhouette above which no other pose is tried: the picture cannot
decide."""


SAME_SHARE = 0.95
"""Share of the remembered colour correlation from which an object counts as unmoved. Chosen on the
rooms lab and desk."""

REMEMBERED_SIGMA = (0.005, 0.005, 0.003, math.radians(1.5))
"""Standard deviations (m, m, m, rad) of a pose confirmed by the remembered appearance: under a
pixel."""


MIN_RELOCALISATION_M = 0.01
"""Displacement in m below which relocalisation is not needed: a solve converges from there."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """An object's window, for the solver and for the likelihood."""

    evidence: Evidence
    observation: Observation


def measure(
    task: Task,
    window: Seen,
    predicted_world_from_object: Pose,
    *,
    is_unchanged: bool = False,
) -> tuple[Seen, Fit]:
    """Solve from the prediction, and from farther away if the result is not conclusive.

    Args:
        task: the object and the frame.
        window: about the prediction.
        predicted_world_from_object: the prediction.
        is_unchanged: the object rests and its pixels did not change, so no other pose is searched.

    Returns:
        The window of the result, and the fit.
    """
    track, evidence = task.track, window.evidence
    # A resting object is compared with the scan alone: its own memory would confirm itself.
    rested = track.state is TrackState.STATIC and track.missed_frames == 0
    appearance = None if rested else track.appearance
    cache = RenderingCache(track.reduced, appearance, quickly=track.moves_on)
    if not rested and track.appearance is not None and track.appearance.was_at_rest:
        back = _as_remembered(task, evidence, cache, track.appearance, predicted_world_from_object)
        if back is not None:
            return window, back
    reaches_px = TRACKING_REACHES if track.missed_frames == 0 else COLD_REACHES
    found = _expected(task, window, cache, predicted_world_from_object, reaches_px=reaches_px)
    if rested and not is_conclusive(task, found.fit) and track.appearance is not None:
        cache = RenderingCache(track.reduced, track.appearance)
        found = _expected(task, window, cache, predicted_world_from_object, reaches_px=reaches_px)
    fit = found.fit
    if is_conclusive(task, fit) or fit.covered_fraction > MOSTLY_COVERED:
        return window, fit
    if is_unchanged and is_accepted(fit, wanted_correlation=min_correlation(track)):
        return window, fit
    relocalisation = _relocalise(task, window, found)
    if relocalisation is not None:
        return relocalisation
    best = search_locally(
        task, evidence, window.observation, cache, predicted_world_from_object, found
    )
    return window, best


def _expected(
    task: Task,
    window: Seen,
    cache: RenderingCache,
    world_from_expected: Pose,
    *,
    reaches_px: tuple[float, ...],
) -> Found:
    """The fit at the expected pose, under the standing prior or, if likelier, the carried one."""
    evidence = window.evidence
    standing, *others = priors(task, world_from_expected)
    fit = attempt(task, evidence, cache, world_from_expected, standing, reaches_px=reaches_px)
    if is_heavy(task, world_from_expected) and is_carriable(task.model.source.box_m):
        others = [carried_prior(task, world_from_expected)]
    if not others or task.is_first or not _has_left(task, fit):
        return Found(fit, standing)
    # What is carried looks like something that slides along its support, and the other way
    # round: both are tried, and the likelier one is taken.
    carried = others[0]
    other = attempt(task, evidence, cache, world_from_expected, carried, reaches_px=reaches_px)
    first, second = Found(fit, standing), Found(other, carried)
    return _likelier(task, window, first=first, second=second)


def _likelier(task: Task, window: Seen, *, first: Found, second: Found) -> Found:
    """The standing or the carried one of two solutions.

    The first centimetres of a lift have the outline of a slide, and an outline in a hand is the
    hand's as well: where the whole picture clearly prefers one of them, it decides.
    """
    standing, carried = sorted((first, second), key=lambda found: float(found.prior.sigma[2]))
    poses = [found.fit.world_from_object for found in (standing, carried)]
    down, up = pose_supports(
        window.observation, task.model, poses=poses, renderer=task.scene.renderer
    )
    is_sunk = poses[1].translation[2] < standing.prior.mean[2]
    if is_heavy(task, poses[0]):
        # What is tall stays on its support until it shows clearly more in the air.
        clear_nats = max(CLEAR_NATS, CLEAR_SHARE * up.nats)
        return carried if up.nats > down.nats + clear_nats and not is_sunk else standing
    if abs(up.nats - down.nats) > CLEAR_NATS and not is_sunk:
        return carried if up.nats > down.nats else standing
    others = (second.fit, second.prior), (first.fit, first.prior)
    return second if is_likelier(task, *others) else first


def _relocalise(task: Task, window: Seen, found: Found) -> tuple[Seen, Fit] | None:
    """The window and fit of feature-based relocalisation, if likelier than what was found."""
    appearance, world_from_found = task.track.appearance, found.fit.world_from_object
    if appearance is None or task.is_first:
        return None
    world_from_relocalised = relocalise(task, appearance, world_from_found.translation)
    if (
        world_from_relocalised is None
        or apart(world_from_found, world_from_relocalised) < MIN_RELOCALISATION_M
    ):
        return None
    view = view_of(task.scene, task.model, world_from_relocalised)
    evidence = gather(task.scene, task.model, view, task.neighbours)
    there = Seen(evidence, observe(task.scene, evidence))
    cache = RenderingCache(None, appearance, quickly=task.track.moves_on)
    relocalisation = _expected(
        task, there, cache, world_from_relocalised, reaches_px=TRACKING_REACHES
    )
    if not task.scene.contains(relocalisation.fit.world_from_object):
        return None
    is_better = log_posterior(task, there.observation, relocalisation) > log_posterior(
        task, window.observation, found
    )
    return (there, relocalisation.fit) if is_better else None


def _as_remembered(
    task: Task,
    evidence: Evidence,
    cache: RenderingCache,
    appearance: AppearanceMemory,
    predicted: Pose,
) -> Fit | None:
    """The fit at the last rest pose, if the object appears there as remembered.

    An object that somebody reached across has not moved, whatever its contour suggests.
    """
    apart = predicted.translation - appearance.world_from_object.translation
    if float(np.linalg.norm(apart)) > task.model.radius_m:
        return None
    fit = at_remembered_pose(task, evidence, cache, appearance)
    is_same = fit.colour_correlation >= SAME_SHARE * appearance.colour_correlation
    return fit if is_same and shows_pattern(fit) else None


def at_remembered_pose(
    task: Task, evidence: Evidence, cache: RenderingCache, appearance: AppearanceMemory
) -> Fit:
    """Fit statistics at the pose of a remembered appearance."""
    world_from_object = appearance.world_from_object
    prior = Prior(pose_vector(world_from_object), np.array(REMEMBERED_SIGMA))
    reduced = cache.at(task.model, world_from_object, evidence, task.scene.renderer)
    information = np.diag(prior.weights())
    return judge(evidence, task.model, world_from_object, information, prior, reduced)


def _has_left(task: Task, fit: Fit) -> bool:
    """Whether an object may have left its rest pose."""
    rested = task.track.state is TrackState.STATIC and task.track.missed_frames == 0
    return not rested or has_left_its_rest(task, fit)
