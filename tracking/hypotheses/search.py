"""Search for an object over the whole room: proposals, screened, aligned, turned and refined.

It proposes on every support plane, so nobody has to select the object again (paper 4.4.2,
"recovery between sessions"). Every stage keeps what the likelihood prefers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.evidence.observation import Observation, observe
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import OTHER_PLACE, Hypothesis, apart, distinct, is_other
from tracking.hypotheses.lens_look import LensLook, look_through
from tracking.hypotheses.prior import moved_log_prior
from tracking.hypotheses.proposals import Similarity, cuts_at, places_on, proposed
from tracking.hypotheses.refinement import ALIGNED_PX, aligned, aligned_coarsely, climbed, refined
from tracking.likelihood.pixel_model import ROUGHLY
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.model.templates import Cuts, compare

Points = NDArray[np.float64]

CUT_AT_ONCE = 400
"""Places cut out of a lens in one step of a search."""

SCREENED_AT_ONCE = 6
"""Proposals screened in one step."""

ALIGNED = 24
"""Proposals that are aligned, the best by their rough likelihood."""

ALIGNED_AT_A_PLACE = 3
"""Of those at one place: a rough likelihood ranks places worse than poses at a place, as it grows
with the silhouette, right or wrong."""

COMPARED = 6
"""Places compared by the likelihood itself, the best by their rough one."""

HOPELESS_NATS = 8.0
"""A pose that is so much less likely than the best is not followed: odds of 3000 to one, more than
an alignment was seen to make up."""

TURNED = 3
"""Places at which all yaws are compared."""

YAWS = 12
"""Yaws compared there; an alignment turns by half the angle between two."""

TURNED_AT_ONCE = 3
"""Of those, compared in one step."""

YAWS_ALIGNED = 4
"""Of those, aligned, the likeliest, beside what was aligned before."""

REFINED = 5
"""Poses refined at full size at most, the likeliest."""

REFINED_AGAIN = 2
"""Of those, refined until they get no likelier."""

MAX_ROUNDS = 3
"""Refinements of one of these at most."""

RESOLVED_NATS = 0.2
"""Gain in nats that is worth another refinement: a fifth changes no odds that matter."""


Rough = tuple[float, Pose, int]
"""Nats of a rough pose, the pose, and the lens that shows it."""


@dataclass(frozen=True, slots=True, eq=False)
class ObjectWindow:
    """An object's window about a place."""

    evidence: Evidence
    observation: Observation


Turned = tuple[float, Pose, ObjectWindow]
"""Nats of an aligned pose, the pose, and the window it was compared in."""


def search(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    support_heights_m: Sequence[float],
    world_from_last: Pose,
    budget: FrameBudget,
) -> list[Hypothesis]:
    """Poses an object may have anywhere on the given heights, the likeliest first.

    Args:
        scene: the frame.
        model: the object.
        neighbours: the other tracked objects.
        support_heights_m: heights of the planes it may stand on.
        world_from_last: where it was; tried as well.
        budget: of this frame.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    lenses = range(len(scene.frame.rig.lenses))
    looks = [look_through(scene, index, model, neighbours, budget=budget) for index in lenses]
    places = budget.do(Step.PLACES, places_on, scene, looks, model, support_heights_m)
    starts = [
        (pose, lens) for lens in lenses for pose in _proposed(looks, places, lens, model, budget)
    ]
    starts += [(world_from_last, lens) for lens in lenses]
    rough: list[Rough] = []
    for first in range(0, len(starts), SCREENED_AT_ONCE):
        some = starts[first : first + SCREENED_AT_ONCE]
        rough += budget.do(Step.SCREEN, _screened, scene, model, looks, some)
    rough.sort(key=lambda item: -item[0])
    some_rough = of_all_places(model, rough)
    rough = [budget.do(Step.ALIGN, align_roughly, scene, model, looks, item) for item in some_rough]
    rough.sort(key=lambda item: -item[0])
    compared: list[Turned] = []
    for pose in best_places(model, rough):
        window = budget.do(Step.GATHER, window_about, scene, model, neighbours, pose)
        compared.append(budget.do(Step.ALIGN, align_in_window, scene, model, window, pose))
    compared.sort(key=lambda item: -item[0])
    turned: list[Turned] = []
    for nats, pose, window in compared[:TURNED]:
        if nats < compared[0][0] - HOPELESS_NATS:
            break
        likeliest = _likeliest_yaws(scene, model, window, pose, budget)
        turned.append((nats, pose, window))
        for start in [*_aligned_here(model, rough, pose), *likeliest]:
            turned.append(budget.do(Step.ALIGN, align_in_window, scene, model, window, start))
    found = _refined(scene, model, turned, budget)
    return distinct(
        model,
        [
            Hypothesis(
                item.fit,
                item.support,
                moved_log_prior(
                    scene,
                    model,
                    support_heights_m,
                    world_from_last=world_from_last,
                    world_from_now=item.world_from_object,
                ),
            )
            for item in found
            if _can_be(scene, item.world_from_object)
        ],
    )


def _proposed(
    looks: Sequence[LensLook],
    places: Sequence[Points],
    lens: int,
    model: TrackModel,
    budget: FrameBudget,
) -> list[Pose]:
    """Poses proposed in one lens."""
    here = places[lens]
    if len(here) == 0:
        return []
    cuts = [
        budget.do(Step.CUT, cuts_at, looks[lens], model, here[first : first + CUT_AT_ONCE])
        for first in range(0, len(here), CUT_AT_ONCE)
    ]
    similar = [budget.do(Step.COMPARE, compare, some, model.templates) for some in cuts]
    return budget.do(Step.PROPOSE, _scored, looks[lens], model, here, cuts, similar)


def _scored(
    look: LensLook,
    model: TrackModel,
    places: Points,
    cuts: Sequence[Cuts],
    similar: Sequence[Similarity],
) -> list[Pose]:
    overlap, correlation = (np.concatenate(parts) for parts in zip(*similar, strict=True))
    return proposed(look, model, places, Cuts.joined(cuts), (overlap, correlation))


def _screened(
    scene: Scene, model: TrackModel, looks: Sequence[LensLook], starts: Sequence[tuple[Pose, int]]
) -> list[Rough]:
    """Rough likelihoods of some proposals."""
    return [score_roughly(scene, model, looks, pose, lens) for pose, lens in starts]


def score_roughly(
    scene: Scene, model: TrackModel, looks: Sequence[LensLook], world_from_object: Pose, lens: int
) -> Rough:
    """A pose with its rough likelihood in one of some looks."""
    observation = _level(looks[lens], model, world_from_object)
    support = pose_support(observation, model, world_from_object, scene.renderer, tolerance=ROUGHLY)
    return support.nats, world_from_object, lens


def _level(look: LensLook, model: TrackModel, pose: Pose) -> Observation:
    range_m = float(np.linalg.norm(model.centre_at(pose) - look.world_from_lens.translation))
    radius_px = look.camera.f_px * model.radius_m / max(range_m, model.radius_m)
    return look.level_for(radius_px, ALIGNED_PX)


def align_roughly(
    scene: Scene, model: TrackModel, looks: Sequence[LensLook], rough: Rough
) -> Rough:
    """A rough pose after its alignment, if that made it likelier."""
    _, pose, lens = rough
    moved = aligned(_level(looks[lens], model, pose), model, pose, scene)
    return max(rough, score_roughly(scene, model, looks, moved, lens), key=lambda item: item[0])


def of_all_places(model: TrackModel, rough: Sequence[Rough]) -> list[Rough]:
    """The best rough poses, no more of one place than another could need."""
    places = np.array([pose.translation for _, pose, _ in rough]).reshape(-1, 3)
    beside = np.zeros(len(rough), dtype=np.int64)
    chosen: list[Rough] = []
    for index, item in enumerate(rough):
        if len(chosen) == ALIGNED:
            break
        if beside[index] < ALIGNED_AT_A_PLACE:
            chosen.append(item)
            apart_m = np.linalg.norm(places - places[index], axis=1)
            beside += apart_m < OTHER_PLACE * model.radius_m
    return chosen


def best_places(model: TrackModel, rough: Sequence[Rough]) -> list[Pose]:
    """The best pose of each of the best places."""
    best: list[Pose] = []
    for _, pose, _ in rough:
        if len(best) < COMPARED and not any(_is_beside(model, pose, other) for other in best):
            best.append(pose)
    return best


def _aligned_here(model: TrackModel, rough: Sequence[Rough], pose: Pose) -> list[Pose]:
    """The best rough poses at a place, each yaw once."""
    here: list[Pose] = []
    for _, other, _ in rough:
        if _is_beside(model, other, pose) and all(is_other(model, other, q) for q in here):
            here.append(other)
    return here[:TURNED]


def _is_beside(model: TrackModel, pose: Pose, other: Pose) -> bool:
    return apart(pose, other) < OTHER_PLACE * model.radius_m


def window_about(
    scene: Scene, model: TrackModel, neighbours: Sequence[Neighbour], world_from_object: Pose
) -> ObjectWindow:
    """The window about a place, as large as any yaw needs."""
    evidence = gather(
        scene, model, view_of(scene, model, world_from_object, at_any_yaw=True), neighbours
    )
    return ObjectWindow(evidence, observe(scene, evidence))


def _likeliest_yaws(
    scene: Scene, model: TrackModel, window: ObjectWindow, pose: Pose, budget: FrameBudget
) -> list[Pose]:
    """A pose turned about up, the likeliest turns of all; round objects need none."""
    if model.symmetry == ROUND:
        return []
    yaw = pose.yaw()
    turns = [Pose.from_yaw(yaw + 2 * math.pi * k / YAWS, pose.translation) for k in range(YAWS)]
    nats: list[float] = []
    for first in range(0, YAWS, TURNED_AT_ONCE):
        some = turns[first : first + TURNED_AT_ONCE]
        nats += budget.do(Step.TURN, _rough_nats, scene, model, window, some)
    return [turns[k] for k in np.argsort(-np.array(nats), kind="stable")[:YAWS_ALIGNED]]


def _rough_nats(
    scene: Scene, model: TrackModel, window: ObjectWindow, poses: Sequence[Pose]
) -> list[float]:
    return [
        pose_support(window.observation, model, at, scene.renderer, tolerance=ROUGHLY).nats
        for at in poses
    ]


def align_in_window(
    scene: Scene, model: TrackModel, window: ObjectWindow, world_from_start: Pose
) -> Turned:
    """A pose aligned at the window's own resolution, or the start if that is likelier."""
    observation = window.observation
    moved = aligned_coarsely(observation, model, world_from_start, scene)
    tried = [
        (pose_support(observation, model, pose, scene.renderer).nats, pose, window)
        for pose in (world_from_start, moved)
    ]
    return max(tried, key=lambda item: item[0])


def _refined(
    scene: Scene,
    model: TrackModel,
    turned: Sequence[Turned],
    budget: FrameBudget,
) -> list[Hypothesis]:
    """The likeliest poses, refined; the very best until they get no likelier."""
    chosen: list[Turned] = []
    for item in sorted(turned, key=lambda item: -item[0]):
        if chosen and item[0] < chosen[0][0] - HOPELESS_NATS:
            break
        if len(chosen) < REFINED and all(is_other(model, item[1], pose) for _, pose, _ in chosen):
            chosen.append(item)
    found = [
        (
            refined(scene, model, pose, window.evidence, window.observation, budget=budget),
            window,
        )
        for _, pose, window in chosen
    ]
    found.sort(key=lambda item: -item[0].support.nats)
    final: list[tuple[Hypothesis, ObjectWindow]] = []
    for rank, (hypothesis, window) in enumerate(found):
        for _ in range(MAX_ROUNDS if rank < REFINED_AGAIN else 0):
            start, evidence = hypothesis.world_from_object, window.evidence
            again = refined(scene, model, start, evidence, window.observation, budget=budget)
            gained = again.support.nats - hypothesis.support.nats
            hypothesis = again if gained > 0.0 else hypothesis
            if gained < RESOLVED_NATS:
                break
        if rank < REFINED_AGAIN:
            hypothesis = _climbed(scene, model, window, hypothesis, budget)
        final.append((hypothesis, window))
    return budget.do(Step.SUPPORT, judge_in_any_light, scene, model, final)


def judge_in_any_light(
    scene: Scene, model: TrackModel, found: Sequence[tuple[Hypothesis, ObjectWindow]]
) -> list[Hypothesis]:
    """Refined hypotheses with the support they have where a shade of the room is no object.

    All poses at a place lose what the best one there loses: which of them is right is nothing that
    a shade could tell.
    """
    judged: list[Hypothesis] = []
    lost_nats: list[tuple[Pose, float]] = []
    for hypothesis, window in sorted(found, key=lambda item: -item[0].support.nats):
        pose, nats = hypothesis.world_from_object, hypothesis.support.nats
        here = [lost for other, lost in lost_nats if _is_beside(model, pose, other)]
        if not here:
            observation = replace(window.observation, in_any_light=True)
            support = pose_support(observation, model, pose, scene.renderer)
            here = [nats - support.nats]
            lost_nats.append((pose, here[0]))
        support = replace(hypothesis.support, nats=nats - here[0])
        judged.append(replace(hypothesis, support=support))
    return judged


def _climbed(
    scene: Scene,
    model: TrackModel,
    window: ObjectWindow,
    hypothesis: Hypothesis,
    budget: FrameBudget,
) -> Hypothesis:
    """What the likelihood itself leads to from a refined pose, refined once more, if likelier."""
    observation, pose = window.observation, hypothesis.world_from_object
    start = climbed(observation, model, pose, scene, budget=budget)
    other = refined(scene, model, start, window.evidence, observation, budget=budget)
    return max(hypothesis, other, key=lambda found: found.support.nats)


def _can_be(scene: Scene, world_from_object: Pose) -> bool:
    """Whether something at a pose is inside the room, and stands on something."""
    stands = bool(scene.support_planes.can_hold(world_from_object.translation[None])[0])
    return stands and scene.contains(world_from_object)
