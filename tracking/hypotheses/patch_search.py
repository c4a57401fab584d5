"""Search for small objects by their colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.evidence.rendering import reduced_rendering
from tracking.evidence.surroundings import Surroundings, surroundings_of
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import START_SIGMA, STARTS_A_PLACE, Hypothesis, apart, is_other
from tracking.likelihood.patch_fit import (
    detail_similarities,
    fit_patch,
    fit_patch_closely,
    fit_patch_roughly,
    similarity_at,
)
from tracking.model.object_model import TrackModel
from tracking.solve.gauss_newton import Fit, Prior, judge
from tracking.solve.motion import pose_vector
from tracking.solve.patch_slide import SmallSlide

Points = NDArray[np.float64]

SMALL_M = 0.25
SMALL_PX = 40.0
SMALL_SIGMA = (0.01, 0.01, 0.003, 0.05)
"""Objects of a smaller radius are placed by their colours; how well: metres and radians."""

YAWS, YAWS_FIRST, PLACES_TURNED, OUTDONE = 12, 4, 14, 0.25
"""Of so many yaws so many are compared at every place, and the others at the best ones: at so many
at most, and not where nothing comes within the last of the best resemblance."""

REFINED = 10
"""So many of these poses are refined roughly."""

REFINED_CLOSELY = 6
"""Rough poses that are refined closely."""

PLACES_COMPARED = 3
"""Positions of these at which other yaws are refined as well."""

YAWS_COMPARED = 6
"""Other yaws refined at each of these positions."""

REFINED_AGAIN = 4
"""Best results that are refined once more."""


RIVAL = 0.6
"""Share of the best similarity from which yaws of one position are compared by detail. Chosen on
the rooms lab and desk."""

RIVALS = 4
"""Yaws compared by detail at most."""


ACCEPTED = 0.1
"""Similarity from which a pose is a hypothesis. Chosen on the rooms lab and desk."""

RECOGNISED = 0.12
"""Similarity from which the object is recognised at a pose. Chosen on the rooms lab and desk."""


Candidate = tuple[Pose, float, Surroundings]
"""A pose, its similarity to the picture, and its window."""


def hypotheses(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    places: Points,
    *,
    budget: FrameBudget,
) -> list[Hypothesis]:
    """Hypotheses of a small object from candidate positions; the likeliest are refined closely.

    Args:
        scene: the frame.
        model: the object.
        neighbours: other objects, whose positions are taken.
        places: (P, 3) candidate positions, m.
        budget: of this frame.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    fine: list[Candidate] = []

    def closely(around: Surroundings, world_from_rough: Pose) -> Candidate:
        rival = max((similarity for _, similarity, _ in fine), default=0.0)
        pose, similarity = budget.do(
            Step.PATCH_CLOSELY, fit_patch_closely, around, world_from_rough, rival=rival
        )
        return pose, similarity, around

    rough = [
        (*budget.do(Step.PATCH_ROUGHLY, fit_patch_roughly, around, start), around)
        for start, around in _starts(scene, model, neighbours, places, budget)
    ]
    rough.sort(key=lambda item: -item[1])
    for pose, _, around in rough[:REFINED_CLOSELY]:
        fine.append(closely(around, pose))
    for rank, (best, around) in enumerate(_best_places(model, fine)):
        # Similar yaws have to be compared at the same position.
        tried = [pose for pose, _, _ in fine]
        if rank == 0:
            others = _on_the_spot(best)
        else:
            others = budget.do(Step.PATCH_YAWS, _other_yaws, around, best, tried)
        for pose in others:
            fine.append(closely(around, pose))
    fine.sort(key=lambda item: -item[1])
    # Steps that have become small too early are taken anew.
    finest = [closely(around, pose) for pose, _, around in _distinct(model, fine[:REFINED_AGAIN])]
    candidates = finest + fine + rough[REFINED_CLOSELY:]
    candidates = [item for item in candidates if item[1] >= ACCEPTED]
    candidates = sorted(_ranked_by_detail(model, candidates, budget), key=lambda item: -item[1])
    return [
        budget.do(Step.PATCH_JUDGE, _placed, around, pose, share)
        for pose, share, around in _distinct(model, candidates)
    ]


def _distinct(model: TrackModel, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Those whose poses differ from all before them."""
    distinct: list[Candidate] = []
    for item in candidates:
        if all(is_other(model, item[0], pose) for pose, _, _ in distinct):
            distinct.append(item)
    return distinct


def _ranked_by_detail(
    model: TrackModel, candidates: Sequence[Candidate], budget: FrameBudget
) -> list[Candidate]:
    """The same candidates, the yaws of each of the best positions ranked by their detail.

    A side that was scanned dark or sparsely accounts for less of a change than a wrong one may.
    """
    left = sorted(candidates, key=lambda item: -item[1])
    ranked: list[Candidate] = []
    for best, around in _best_places(model, left):
        here = [item for item in left if apart(item[0], best) <= model.radius_m]
        left = [item for item in left if apart(item[0], best) > model.radius_m]
        rivals: list[Pose] = []
        for pose, similarity, _ in here:
            if similarity >= RIVAL * here[0][1] and all(is_other(model, pose, p) for p in rivals):
                rivals.append(pose)
        rivals = rivals[:RIVALS]
        detail_scores = budget.do(Step.PATCH_DETAIL, detail_similarities, around, rivals)
        if detail_scores is None:
            ranked += here
            continue
        ranked += [
            (pose, here[0][1] + similarity - max(detail_scores), around)
            for pose, similarity in zip(rivals, detail_scores, strict=True)
        ]
        ranked += [item for item in here if all(is_other(model, item[0], pose) for pose in rivals)]
    return ranked + left


def _best_places(
    model: TrackModel, candidates: Sequence[Candidate]
) -> list[tuple[Pose, Surroundings]]:
    """The best poses of the best places, which are a radius apart."""
    best: list[tuple[Pose, Surroundings]] = []
    for pose, _, around in sorted(candidates, key=lambda item: -item[1]):
        if all(apart(pose, other) > model.radius_m for other, _ in best):
            best.append((pose, around))
    return best[:PLACES_COMPARED]


def refined(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose
) -> Hypothesis:
    """What a rough pose of a small object comes to, as its colours have it."""
    around = surroundings_of(scene, model, evidence)
    return _placed(around, *fit_patch(around, world_from_start))


@dataclass(frozen=True, slots=True, eq=False)
class _Tried:
    """A place about which a small object's yaws are compared.

    Attributes:
        poses: one a yaw, each slid to where it fits best.
        similarity: (Y,) how much each looks like the picture.
        around: the object's window.
    """

    poses: list[Pose]
    similarity: Points
    around: Surroundings


def _starts(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    places: Points,
    budget: FrameBudget,
) -> list[tuple[Pose, Surroundings]]:
    """Poses near some places that look most like the picture, with their windows, best first."""
    some = range(0, YAWS, YAWS // YAWS_FIRST)
    others = [k for k in range(YAWS) if k not in some]
    tried = [
        budget.do(Step.PATCH_FIRST_YAWS, _tried, scene, model, neighbours, place, some)
        for place in places
    ]
    tried.sort(key=lambda at: -at.similarity.max())
    found: list[tuple[float, Pose, Surroundings]] = []
    least = max((at.similarity.max() for at in tried), default=0.0) - OUTDONE
    for at in tried[:PLACES_TURNED]:
        if at.similarity.max() < least:
            break
        here = at.poses[0].translation
        more = budget.do(Step.PATCH_OTHER_YAWS, _compared, at.around, here, others)
        poses, similarity = (
            [*at.poses, *more.poses],
            np.concatenate([at.similarity, more.similarity]),
        )
        order = [int(k) for k in np.argsort([*some, *others])]
        poses, similarity = [poses[k] for k in order], similarity[order]
        peaks = np.flatnonzero(
            (similarity >= np.roll(similarity, 1)) & (similarity > np.roll(similarity, -1))
        )
        best = peaks[np.argsort(-similarity[peaks], kind="stable")][:STARTS_A_PLACE]
        found += [(float(similarity[k]), poses[k], at.around) for k in best]
    found.sort(key=lambda item: -item[0])
    distinct: list[tuple[Pose, Surroundings]] = []
    for _, pose, around in found:
        if len(distinct) < REFINED and all(is_other(model, pose, p) for p, _ in distinct):
            distinct.append((pose, around))
    return distinct


def _tried(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    place: Points,
    yaws: Sequence[int],
) -> _Tried:
    """A place with some of `YAWS` compared."""
    view = view_of(scene, model, Pose.from_yaw(0.0, place), at_any_yaw=True)
    evidence = gather(scene, model, view, neighbours)
    return _compared(surroundings_of(scene, model, evidence), place, yaws)


def _compared(around: Surroundings, place: Points, yaws: Sequence[int]) -> _Tried:
    """Some of `YAWS` about a place, which is right to a part of the object: each is slid first."""
    slide = SmallSlide(around)
    poses = [slide.best(Pose.from_yaw(2 * math.pi * k / YAWS, place)) for k in yaws]
    return _Tried(poses, np.array([similarity_at(around, pose) for pose in poses]), around)


def _other_yaws(around: Surroundings, world_from_object: Pose, tried: Sequence[Pose]) -> list[Pose]:
    """A small object's likeliest other yaws at a place, without those that were tried there."""
    place, yaw = world_from_object.translation, world_from_object.yaw()
    slide = SmallSlide(around)
    yaws = [yaw + 2 * math.pi * k / YAWS for k in range(YAWS)]
    poses = [slide.best(Pose.from_yaw(turned, place)) for turned in yaws]
    similarity = np.array([similarity_at(around, pose) for pose in poses])
    order = [int(k) for k in np.argsort(-similarity, kind="stable")]
    others = [
        poses[k] for k in order if all(is_other(around.model, poses[k], pose) for pose in tried)
    ]
    return others[:YAWS_COMPARED]


def _on_the_spot(world_from_object: Pose) -> list[Pose]:
    """The other `YAWS` of a small object where it is.

    As scanned, the side that is seen may be so dark that it slides off to a shadow, and looks like
    nothing until it is in the right light at the right place.
    """
    place, yaw = world_from_object.translation, world_from_object.yaw()
    return [Pose.from_yaw(yaw + 2 * math.pi * k / YAWS, place) for k in range(1, YAWS)]


def _placed(around: Surroundings, world_from_object: Pose, share: float) -> Hypothesis:
    """The hypothesis of a small object at a pose with this similarity."""
    model, evidence = around.model, around.evidence
    reduced = reduced_rendering(model, world_from_object, evidence, around.renderer)
    prior = Prior(pose_vector(world_from_object), np.array(START_SIGMA))
    information = np.diag(1.0 / Prior(prior.mean, np.array(SMALL_SIGMA)).seven() ** 2)
    return Hypothesis(judge(evidence, model, world_from_object, information, prior, reduced), share)


def is_recognised(scene: Scene, model: TrackModel, evidence: Evidence, fit: Fit) -> bool | None:
    """Whether a small object is recognised by its colours at a pose; None for a large object.

    Silhouettes of small objects are similar, and their inner colours carry little from afar. If
    another yaw is more similar, the object has been turned.
    """
    if not is_small(model, evidence):
        return None
    around = surroundings_of(scene, model, evidence)
    found = _placed(around, *fit_patch(around, fit.world_from_object))
    if found.score < RECOGNISED:
        return False
    here = found.world_from_object
    others = _other_yaws(around, here, [here])
    candidates = (fit_patch_closely(around, pose, rival=found.score) for pose in others)
    # What comes back to the same pose only says so better.
    return not any(
        share > found.score and is_other(model, pose, here) for pose, share in candidates
    )


def settled(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> Fit | None:
    """Where a small textured object came to rest, by its colours; None for any other object."""
    if not (model.textured and is_small(model, evidence)):
        return None
    return refined(scene, model, evidence, world_from_object).fit


def is_small(model: TrackModel, evidence: Evidence) -> bool:
    """Whether an object is seen so small that its colours decide rather than its contour."""
    radius_px = evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
    return radius_px < SMALL_PX
