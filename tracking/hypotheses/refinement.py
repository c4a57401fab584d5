"""Refinement of a rough pose by outline and by colours, and its likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Scene
from tracking.evidence.observation import Observation
from tracking.evidence.rendering import RenderingCache, reduced_rendering
from tracking.evidence.surroundings import surroundings_in
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis
from tracking.likelihood.drawn_object import radius_px
from tracking.likelihood.patch_fit import fit_patch_closely, fit_patch_roughly
from tracking.likelihood.pose_likelihood import pose_support, pose_supports
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
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

CLIMBED_PX = 34.0
"""Radius in px at which the likelihood is climbed: at 18 it led four half-hidden or glossy objects
of random rooms astray, at 36 it brought three of them closer."""

CLIMB_STEP = 0.15
"""First step of a climb, in radii of the object and rad: what an alignment leaves."""

CLIMB_RESOLVED = 0.02
"""Step below which a climb ends: half a pixel at `CLIMBED_PX`."""

CLEAR_SHARE = 0.2
"""Share of its nats, or of its nats a sample, by which another pose has to show more than a
solver's before it is climbed to: a model's own faults moved a suitcase at rest 8 cm for 4 of 38
nats; what a solver loses of who carries it are 70 of 150."""

ALIGNED_PX = 18.0
"""Radius in px at which a rough pose is aligned: a place of the search's grid, off by an eighth of
the object, is then off by two pixels, what the lens blurs."""


def align(
    observation: Observation, model: TrackModel, world_from_rough: Pose, scene: Scene
) -> Pose:
    """A rough pose laid on the picture by the object's colours at a coarse scale."""
    around = surroundings_in(observation, model, scene.renderer)
    return fit_patch_roughly(around, world_from_rough)


def refine(
    scene: Scene,
    model: TrackModel,
    world_from_start: Pose,
    evidence: Evidence,
    observation: Observation,
    *,
    sigma: tuple[float, float, float, float] = START_SIGMA,
    quickly: bool = False,
    budget: FrameBudget | None = None,
) -> Hypothesis:
    """Refine a rough pose: the likeliest of the solved, the colour-fitted and the start.

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
        budget: of this frame; none is no limit.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    do = (budget or FrameBudget()).do
    from_colours = do(Step.ALIGN, align_coarsely, observation, model, world_from_start, scene)
    fits = [
        do(Step.SOLVE, _solve, scene, model, start, evidence, sigma=sigma, quickly=quickly)
        for start in (world_from_start, from_colours)
    ]
    best = do(Step.SUPPORT, _likelier, scene, model, observation, fits)
    poses = [world_from_start, Pose(world_from_start.rotation, from_colours.translation)]
    if radius_px(observation, model, world_from_start) < OUTLINED_PX:
        around = surroundings_in(observation, model, scene.renderer)
        poses.append(do(Step.PATCH, fit_patch_closely, around, world_from_start)[0])
    return do(Step.SUPPORT, _likeliest, scene, model, evidence, observation, best, poses)


def align_coarsely(
    observation: Observation, model: TrackModel, world_from_rough: Pose, scene: Scene
) -> Pose:
    """A rough pose laid on an observation of any scale."""
    return align(coarse(observation, model, world_from_rough), model, world_from_rough, scene)


def _likelier(
    scene: Scene, model: TrackModel, observation: Observation, fits: Sequence[Fit]
) -> Hypothesis:
    """The fit that the picture speaks for most."""
    poses = [fit.world_from_object for fit in fits]
    found = pose_supports(observation, model, poses=poses, renderer=scene.renderer)
    supported = [Hypothesis(fit, support) for fit, support in zip(fits, found, strict=True)]
    return max(supported, key=lambda hypothesis: hypothesis.support.nats)


def _likeliest(
    scene: Scene,
    model: TrackModel,
    evidence: Evidence,
    observation: Observation,
    best: Hypothesis,
    poses: Sequence[Pose],
) -> Hypothesis:
    """A hypothesis, or a pose that the picture speaks for more."""
    found = pose_supports(observation, model, poses=poses, renderer=scene.renderer)
    for pose, support in zip(poses, found, strict=True):
        if support.nats > best.support.nats:
            best = Hypothesis(fit_at(scene, model, evidence, pose), support)
    return best


def climb(
    observation: Observation,
    model: TrackModel,
    world_from_start: Pose,
    scene: Scene,
    *,
    budget: FrameBudget | None = None,
) -> Pose:
    """The pose near a start at which the likelihood itself is highest, at a middling scale.

    A solver follows the outline, of which a half-hidden or badly lit object shows a part; this
    follows everything (pattern search over the line of sight, across it, and yaw).

    Args:
        observation: of a window around the start.
        model: the object.
        world_from_start: where to begin.
        scene: the frame.
        budget: of this frame; none is no limit.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    do = (budget or FrameBudget()).do
    seen = do(Step.CLIMB, for_climb, observation, model, world_from_object=world_from_start)
    pose, best = world_from_start, -math.inf
    step = CLIMB_STEP
    while step >= CLIMB_RESOLVED:
        higher = do(Step.CLIMB, _higher, seen, model, pose, best, step, scene)
        if higher is None:
            step /= 2.0
        else:
            best, pose = higher
    return pose


def for_climb(observation: Observation, model: TrackModel, world_from_object: Pose) -> Observation:
    """An observation at the scale at which the likelihood is climbed."""
    times = radius_px(observation, model, world_from_object) / CLIMBED_PX
    return observation.shrunk(max(math.floor(times), 1))


def climb_if_clear(
    seen: Observation,
    model: TrackModel,
    *,
    world_from_start: Pose,
    scene: Scene,
    log_prior: Callable[[Pose], float],
) -> Pose | None:
    """The pose that a climb ends at; None if it is not clearly likelier than its start.

    Args:
        seen: a window around the start, as `for_climb` has it.
        model: the object.
        world_from_start: where to begin.
        scene: the frame.
        log_prior: nats of a pose before anything was seen.
    """

    def likeliest(poses: Sequence[Pose]) -> tuple[float, float, Pose]:
        found = pose_supports(seen, model, poses=poses, renderer=scene.renderer)
        odds = [said.nats + log_prior(pose) for said, pose in zip(found, poses, strict=True)]
        best = int(np.argmax(odds))
        return odds[best], found[best].nats_a_sample, poses[best]

    start, start_rate, pose = likeliest([world_from_start])
    for step in (2.0 * CLIMB_STEP, CLIMB_STEP):
        beside = list(_all_beside(seen, model, world_from_object=pose, step=step))
        best, rate, other = likeliest(beside)
        # So many poses are tried that one of them is likelier by chance.
        if best > start + CLEAR_NATS + math.log(len(beside)):
            break
    else:
        return None
    pose = other
    while step >= CLIMB_RESOLVED:
        beside = list(_all_beside(seen, model, world_from_object=pose, step=step))
        odds, other_rate, other = likeliest(beside)
        if odds > best:
            best, rate, pose = odds, other_rate, other
        else:
            step /= 2.0
    # What is nearer covers more pixels, and has more nats of what is around it.
    share = 1.0 - CLEAR_SHARE
    return pose if start < share * best or start_rate < share * rate else None


def _all_beside(
    observation: Observation, model: TrackModel, *, world_from_object: Pose, step: float
) -> Iterator[Pose]:
    """Poses a step away: as `_beside`, and up and down."""
    yield from _beside(observation, model, world_from_object, step)
    for length_m in (step * model.radius_m, -step * model.radius_m):
        place = world_from_object.translation + np.array([0.0, 0.0, length_m])
        yield Pose(world_from_object.rotation, place)


def _higher(
    seen: Observation, model: TrackModel, pose: Pose, best: float, step: float, scene: Scene
) -> tuple[float, Pose] | None:
    """The first pose a step away, or for the first time the pose itself, that is likelier."""
    tried = [pose] if best == -math.inf else _beside(seen, model, pose, step)
    for other in tried:
        nats = pose_support(seen, model, other, scene.renderer).nats
        if nats > best:
            return nats, other
    return None


def _beside(
    observation: Observation, model: TrackModel, world_from_object: Pose, step: float
) -> Iterator[Pose]:
    """Poses a step away along the line of sight, across it, and turned; both ways."""
    away = model.centre_at(world_from_object) - observation.world_from_camera.translation
    ahead = np.array([away[0], away[1], 0.0]) / max(float(np.hypot(away[0], away[1])), 1e-9)
    across = np.array([-ahead[1], ahead[0], 0.0])
    length_m = step * model.radius_m
    for direction in (ahead, -ahead, across, -across):
        place = world_from_object.translation + length_m * direction
        yield Pose(world_from_object.rotation, place)
    if model.symmetry != ROUND:
        for turn in (step, -step):
            yield Pose.from_yaw(world_from_object.yaw() + turn, world_from_object.translation)


def _solve(
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


def fit_at(scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose) -> Fit:
    """Statistics of a pose that colours gave."""
    reduced = reduced_rendering(model, world_from_object, evidence, scene.renderer)
    prior = Prior(pose_vector(world_from_object), np.array(START_SIGMA))
    information = np.diag(1.0 / Prior(prior.mean, np.array(PLACED_SIGMA)).seven() ** 2)
    return judge(evidence, model, world_from_object, information, prior, reduced)


def coarse(observation: Observation, model: TrackModel, world_from_object: Pose) -> Observation:
    """An observation at which the object is as large as an alignment wants it."""
    times = radius_px(observation, model, world_from_object) / ALIGNED_PX
    return observation.shrunk(max(math.floor(times), 1))
