"""Local pose search around the prediction: displaced, turned or lifted.

And around what a solver made of it: the likelihood knows shadows, and who carries an object.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from scenes.pose import Pose, wrap_angle
from tracking.evidence.evidence import Evidence
from tracking.evidence.observation import Observation
from tracking.evidence.rendering import RenderingCache
from tracking.follow.attempt import attempt
from tracking.follow.belief import Belief, accounts_for, at_pose, near
from tracking.follow.carried import is_lifted
from tracking.follow.posterior import (
    CONCLUSIVE_INLIER_RATIO,
    CONTACT_SIGMA_M,
    RECOGNISED_CORRELATION,
    is_accepted,
    is_carriable,
    is_conclusive,
    priors,
)
from tracking.follow.track import Task
from tracking.hypotheses.budget import Step, steps_within
from tracking.hypotheses.hypothesis import CLEAR_NATS
from tracking.hypotheses.refinement import climb_if_clear, for_climb
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import (
    COLD_REACHES,
    GROWN_REACHES,
    SLID_REACHES,
    TRACKING_REACHES,
    Fit,
    Prior,
)
from tracking.solve.motion import pose_vector, vector_pose

MIN_HYPOTHESES = 2
"""Least number of local hypotheses evaluated in a frame."""

SEARCH_PART = 3
"""One of so many parts of the stream's frame interval goes into the local search of an object. By
the time since the last measurement, which grows with every late frame, late frames got later: two
hidden objects took 180 ms a frame. Chosen on the rooms lab and desk."""


NEAR_TURN_RAD = 0.17
"""Turn in rad of a local hypothesis where the fit at the prediction is accepted. Chosen on the
rooms lab and desk."""

FAR_TURN_RAD = 0.35
"""The same where it is not. Chosen on the rooms lab and desk."""


LIFTS_M = (0.04, 0.08, 0.12)
"""Heights in m above the prediction of local hypotheses of a carried object. Chosen on the rooms
lab and desk."""


JUMP_M = 0.08
"""Distance in m from the prediction that is always reachable. Chosen on the rooms lab and desk."""

FASTEST_M_S = 2.0
"""Speed in m/s of a carried object at most. Chosen on the rooms lab and desk."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A solution and the prior under which it was found."""

    fit: Fit
    prior: Prior


def search_locally(
    task: Task,
    evidence: Evidence,
    observation: Observation,
    cache: RenderingCache,
    predicted_world_from_object: Pose,
    found: Found,
) -> Fit:
    """The fit at the prediction, or a clearly likelier one nearby.

    Between poses about as likely, the solver's outline at the prediction is the more exact.

    Args:
        task: the object and the frame.
        evidence: its window.
        observation: of the same window.
        cache: reduced renderings of the object in this window so far.
        predicted_world_from_object: the prediction.
        found: the fit there.
    """
    priors_here = priors(task, predicted_world_from_object)
    best, highest = found.fit, log_posterior(task, observation, found) + CLEAR_NATS
    for hypothesis in _hypotheses(task, priors_here, predicted_world_from_object, best):
        (other, posterior), _ = task.costs.timed(
            Step.LOCAL_HYPOTHESIS,
            partial(_weighed, task, evidence, observation, cache, hypothesis),
        )
        if hypothesis.is_free and not is_lifted(task, other.world_from_object):
            continue
        if not _is_reachable(task, predicted_world_from_object, other):
            continue
        if posterior > highest:
            best, highest = other, posterior
        if is_conclusive(task, best):
            break
    return best


def log_posterior(task: Task, observation: Observation, found: Found) -> float:
    """Nats of a solution: what the picture says for its pose, and how far it is from expected."""
    pose = found.fit.world_from_object
    nats = pose_support(observation, task.model, pose, task.scene.renderer).nats
    apart = pose_vector(pose) - found.prior.mean
    apart[3] = 0.0 if task.model.symmetry == ROUND else wrap_angle(float(apart[3]))
    return nats - 0.5 * float(((apart / found.prior.sigma) ** 2).sum())


@dataclass(frozen=True, slots=True, eq=False)
class _LocalHypothesis:
    """A start pose beside the prediction.

    Attributes:
        prior: of the pose.
        start_world_from_object: where to begin.
        slides: whether the rendering is first slid over the picture.
    """

    prior: Prior
    start_world_from_object: Pose
    slides: bool

    @property
    def is_free(self) -> bool:
        """Whether the hypothesis has the object on no support plane."""
        return bool(self.prior.sigma[2] > CONTACT_SIGMA_M)


def _hypotheses(
    task: Task, priors_here: Sequence[Prior], predicted_world_from_object: Pose, best: Fit
) -> list[_LocalHypothesis]:
    """This frame's hypotheses: the prediction itself, then turned and lifted starts in rotation."""
    turn = NEAR_TURN_RAD if is_accepted(best) else FAR_TURN_RAD
    yaws = (0.0,) if task.model.symmetry == ROUND else (0.0, turn, -turn)
    steps = [(prior, 0.0, yaw) for prior in priors_here for yaw in yaws]
    steps += [(b, z, 0.0) for b in priors_here if b.sigma[2] > CONTACT_SIGMA_M for z in LIFTS_M]
    within = steps_within(task.costs, Step.LOCAL_HYPOTHESIS, task.interval_ns // SEARCH_PART)
    count = min(max(MIN_HYPOTHESES, within), len(steps))
    # The likeliest is tried in every frame, the others in turn.
    others = steps[1:]
    first = task.scene.frame.seq * (count - 1) % len(others) if others else 0
    chosen = steps[:1] + (others[first:] + others[:first])[: count - 1]
    expected = pose_vector(predicted_world_from_object)
    return [
        _LocalHypothesis(prior, vector_pose(expected + np.array([0.0, 0.0, z, yaw])), z == 0.0)
        for prior, z, yaw in chosen
    ]


def _weighed(
    task: Task,
    evidence: Evidence,
    observation: Observation,
    cache: RenderingCache,
    hypothesis: _LocalHypothesis,
) -> tuple[Fit, float]:
    """The solve from one hypothesis, and its log posterior."""
    fit = _followed(task, evidence, cache, hypothesis)
    return fit, log_posterior(task, observation, Found(fit, hypothesis.prior))


def _followed(
    task: Task, evidence: Evidence, cache: RenderingCache, hypothesis: _LocalHypothesis
) -> Fit:
    """The solve from one hypothesis."""
    wide = replace(hypothesis.prior, sigma=hypothesis.prior.sigma * np.array([2.0, 2.0, 1.0, 2.0]))
    slid = SLID_REACHES if task.model.textured else COLD_REACHES
    reaches = slid if hypothesis.slides else TRACKING_REACHES
    start = hypothesis.start_world_from_object
    fit = attempt(task, evidence, cache, start, wide, reaches_px=reaches, slide=hypothesis.slides)
    correlates = fit.textured and fit.colour_correlation >= RECOGNISED_CORRELATION
    if not (hypothesis.slides and correlates) or fit.contour_score >= CONCLUSIVE_INLIER_RATIO:
        return fit
    start = fit.world_from_object
    grown = attempt(task, evidence, cache, start, wide, reaches_px=GROWN_REACHES)
    return max(fit, grown, key=lambda found: found.score)


def _is_reachable(task: Task, predicted_world_from_object: Pose, fit: Fit) -> bool:
    """Whether an object can have been moved there since it was last seen."""
    apart = fit.world_from_object.translation - predicted_world_from_object.translation
    elapsed = (task.scene.frame.t_ns - task.track.seen_ns) * 1e-9
    return float(np.linalg.norm(apart)) < JUMP_M + FASTEST_M_S * elapsed


def climb_beside(
    task: Task, belief: Belief, *, evidence: Evidence, predicted_world_from_object: Pose
) -> Belief:
    """The belief at a clearly likelier pose near the measured one, if there is one.

    A solver follows edges; those of a shadow and of who carries the object are some, too.

    Args:
        task: the object and the frame.
        belief: the measurement.
        evidence: its window.
        predicted_world_from_object: the prediction.
    """
    scene, model, found = task.scene, task.model, belief.fit.world_from_object
    prior = priors(task, predicted_world_from_object)[0]
    flat = [0, 1, 3]
    lowest_m = min(task.support_heights_m) - CONTACT_SIGMA_M
    can_lift = is_carriable(model.source.box_m)

    def log_prior(world_from_object: Pose) -> float:
        apart = pose_vector(world_from_object) - prior.mean
        apart[3] = 0.0 if model.symmetry == ROUND else wrap_angle(float(apart[3]))
        nats = -0.5 * float(((apart[flat] / prior.sigma[flat]) ** 2).sum())
        height_m = float(world_from_object.translation[2])
        if height_m == float(found.translation[2]):
            return nats
        return nats - CLEAR_NATS if can_lift and height_m > lowest_m else -math.inf

    seen = for_climb(belief.observation, model, world_from_object=found)
    seen = near(seen, model, world_from_object=found, renderer=scene.renderer)
    likelier = climb_if_clear(seen, model, world_from_start=found, scene=scene, log_prior=log_prior)
    if likelier is None:
        return belief
    among = near(belief.observation, model, world_from_object=found, renderer=scene.renderer)
    support = pose_support(among, model, likelier, scene.renderer)
    is_shown = accounts_for(task.track, support.nats_a_sample)
    return at_pose(task, evidence, belief, likelier) if is_shown else belief
