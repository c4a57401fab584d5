"""Search for an object over the whole room: proposals, screened, aligned, turned and refined.

It proposes on every support plane, so nobody has to select the object again (paper 4.4.2,
"recovery between sessions"). Every stage keeps what the likelihood prefers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.evidence.observation import Observation, observe
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import OTHER_PLACE, Hypothesis, apart, distinct, is_other
from tracking.hypotheses.lens_look import look_through
from tracking.hypotheses.prior import moved_log_prior
from tracking.hypotheses.proposals import places_on
from tracking.hypotheses.refinement import align_coarsely, climb, refine
from tracking.hypotheses.screening import Rough, propose, screen
from tracking.likelihood.pixel_model import ROUGHLY
from tracking.likelihood.pose_likelihood import pose_support, pose_supports
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND

COMPARED = 6
"""Places compared by the likelihood itself, the best by their rough one, both ways."""

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


@dataclass(frozen=True, slots=True, eq=False)
class ObjectWindow:
    """An object's window about a place.

    Attributes:
        evidence: the window.
        observation: of it.
        shade_nats: nats at this place for which another light on the room accounts as well.
    """

    evidence: Evidence
    observation: Observation
    shade_nats: float = 0.0


Turned = tuple[float, Pose, ObjectWindow]
"""Nats of an aligned pose less those of a shade, the pose, and the window it was compared in."""


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
        (pose, lens) for lens in lenses for pose in propose(looks, places, lens, model, budget)
    ]
    starts += [(world_from_last, lens) for lens in lenses]
    rough = screen(scene, model, looks, starts, budget)
    turned = _turn_at_best_places(scene, model, neighbours, rough, budget)
    found = _refine_likeliest(scene, model, turned, budget)
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


def _turn_at_best_places(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    rough: Sequence[Rough],
    budget: FrameBudget,
) -> list[Turned]:
    """Poses at the likeliest places, at all yaws that may be right, aligned in their windows."""
    compared: list[Turned] = []
    for pose in best_places(model, rough):
        window = budget.do(Step.GATHER, window_about, scene, model, neighbours, pose)
        aligned = budget.do(Step.ALIGN, align_in_window, scene, model, window, pose)
        compared.append(budget.do(Step.SUPPORT, less_shade, scene, model, aligned=aligned))
    turned: list[Turned] = []
    for nats, pose, window in worth_turning(compared):
        likeliest = _likeliest_yaws(scene, model, window, pose, budget)
        turned.append((nats, pose, window))
        for start in [*_aligned_here(model, rough, pose), *likeliest]:
            turned.append(budget.do(Step.ALIGN, align_in_window, scene, model, window, start))
    return turned


def worth_turning(compared: Sequence[Turned]) -> list[Turned]:
    """The likeliest of some poses, the likeliest first, and the first, the best one roughly.

    Where its yaw is wrong, a place shows roughly alone: a chair turned by a third of a circle had
    11 nats roughly and -20 closely, and slivers behind a curtain had 3.
    """
    likely = sorted(compared, key=lambda item: -item[0])[:TURNED]
    likely = [item for item in likely if item[0] >= likely[0][0] - HOPELESS_NATS]
    first = compared[0]
    is_among = any(item is first for item in likely)
    return likely if is_among else [*likely[: TURNED - 1], first]


def less_shade(scene: Scene, model: TrackModel, *, aligned: Turned) -> Turned:
    """The first pose that is aligned in a window, less what a shade of the room accounts for."""
    nats, pose, window = aligned
    shade_nats = _shade_nats(scene, model, nats=nats, world_from_object=pose, window=window)
    return nats - shade_nats, pose, replace(window, shade_nats=shade_nats)


def _shade_nats(
    scene: Scene, model: TrackModel, *, nats: float, world_from_object: Pose, window: ObjectWindow
) -> float:
    """Of the nats of a pose those for which another light on the room accounts as well."""
    observation = replace(window.observation, in_any_light=True)
    return nats - pose_support(observation, model, world_from_object, scene.renderer).nats


def best_places(model: TrackModel, rough: Sequence[Rough]) -> list[Pose]:
    """The first pose of each of the first places."""
    best: list[Pose] = []
    for pose in (item.world_from_object for item in rough):
        if len(best) < COMPARED and not any(_is_beside(model, pose, other) for other in best):
            best.append(pose)
    return best


def _aligned_here(model: TrackModel, rough: Sequence[Rough], pose: Pose) -> list[Pose]:
    """The best rough poses at a place, each yaw once."""
    here: list[Pose] = []
    for other in (item.world_from_object for item in rough):
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
    return ObjectWindow(evidence, observe(scene, evidence, is_looked_for=True))


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
    found = pose_supports(
        window.observation, model, poses=poses, renderer=scene.renderer, tolerance=ROUGHLY
    )
    return [support.nats for support in found]


def align_in_window(
    scene: Scene, model: TrackModel, window: ObjectWindow, world_from_start: Pose
) -> Turned:
    """A pose aligned at the window's own resolution, or the start if that is likelier."""
    observation = window.observation
    poses = (world_from_start, align_coarsely(observation, model, world_from_start, scene))
    found = pose_supports(observation, model, poses=poses, renderer=scene.renderer)
    support, pose = max(zip(found, poses, strict=True), key=lambda item: item[0].nats)
    return support.nats - window.shade_nats, pose, window


def _refine_likeliest(
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
            refine(scene, model, pose, window.evidence, window.observation, budget=budget),
            window,
        )
        for _, pose, window in chosen
    ]
    found.sort(key=lambda item: -item[0].support.nats)
    final: list[tuple[Hypothesis, ObjectWindow]] = []
    for rank, (hypothesis, window) in enumerate(found):
        for _ in range(MAX_ROUNDS if rank < REFINED_AGAIN else 0):
            start, evidence = hypothesis.world_from_object, window.evidence
            again = refine(scene, model, start, evidence, window.observation, budget=budget)
            gained = again.support.nats - hypothesis.support.nats
            hypothesis = again if gained > 0.0 else hypothesis
            if gained < RESOLVED_NATS:
                break
        if rank < REFINED_AGAIN:
            hypothesis = _climb(scene, model, window, hypothesis, budget)
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
            here = [_shade_nats(scene, model, nats=nats, world_from_object=pose, window=window)]
            lost_nats.append((pose, here[0]))
        support = replace(hypothesis.support, nats=nats - here[0])
        judged.append(replace(hypothesis, support=support))
    return judged


def _climb(
    scene: Scene,
    model: TrackModel,
    window: ObjectWindow,
    hypothesis: Hypothesis,
    budget: FrameBudget,
) -> Hypothesis:
    """Climb the likelihood itself from a refined pose and refine once more, if that is likelier."""
    observation, pose = window.observation, hypothesis.world_from_object
    start = climb(observation, model, pose, scene, budget=budget)
    other = refine(scene, model, start, window.evidence, observation, budget=budget)
    return max(hypothesis, other, key=lambda found: found.support.nats)


def _can_be(scene: Scene, world_from_object: Pose) -> bool:
    """Whether something at a pose is inside the room, and stands on something."""
    stands = bool(scene.support_planes.can_hold(world_from_object.translation[None])[0])
    return stands and scene.contains(world_from_object)
