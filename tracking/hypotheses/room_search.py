"""Search for objects over the whole room, after a loss or between sessions.

The best of the proposed positions (`tracking.hypotheses.positions`) are refined;
`tracking.hypotheses.assignment` then decides jointly (paper 4.4.2 "recovery between sessions",
without asking the user to select the objects again).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.evidence.rendering import RenderingCache
from tracking.hypotheses import patch_search
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import (
    APART_RAD,
    START_SIGMA,
    STARTS_A_PLACE,
    Hypothesis,
    apart,
    are_other_turns,
    distinct,
)
from tracking.hypotheses.positions import (
    Overview,
    pixel_evidence,
    proposed,
    scored,
    spread_out,
    template_scores,
)
from tracking.model.object_model import TrackModel
from tracking.model.templates import YAWS, cut_out
from tracking.solve.gauss_newton import Fit, Prior, solve
from tracking.solve.motion import pose_vector
from tracking.solve.patch_slide import SLID

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

REACH_M = 4.5
PLACES_SMALL, PLACES_NEARER = 40, 16
"""Of a small object so many places are looked at; of a large one the surroundings of so many."""

PLACES_REFINED, REFINED_MORE, REFINED_AGAIN, REFINED_TURNED = 12, 6, 6, 4
"""Of a large object a pose is refined at so many places, and so many more at the best of these; so
many of all of them once more; so many of an object whose place is known."""

NEARER = np.arange(-2, 3) * 0.2
"""Steps around a place of those that are looked at more closely, in radii."""

START_REACHES = (10.0, 5.0, 2.5)
"""Search distances in pixels from a start: templates find a place to a tenth of an object."""

UNAMBIGUOUS_CONTOUR_SCORE, UNAMBIGUOUS_VISIBLE = 0.8, 0.9
"""Wrong yaws reach three quarters."""


ACCEPTED_INLIER_RATIO = 0.35
"""Edge inlier ratio from which a refined pose is a hypothesis. Chosen on the rooms lab and desk."""

ACCEPTED_SCORE = 0.3
"""Score from which a refined pose is a hypothesis. Chosen on the rooms lab and desk."""

ACCEPTED_CORRELATION = 0.25
"""Colour correlation from which a refined pose of a textured object is a hypothesis. Chosen on the
rooms lab and desk."""


def candidates(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    support_heights_m: Sequence[float],
    last: Points,
    enough: int,
    budget: FrameBudget,
    reach_m: float = REACH_M,
) -> list[Hypothesis]:
    """Poses an object may have anywhere on the given heights, the best first.

    Args:
        scene: the frame.
        look: its overview.
        model: the object.
        neighbours: other objects, whose places are taken.
        support_heights_m: heights of the planes it may stand on.
        last: (3,) where it was seen last; tried as well.
        enough: the search ends with so many poses that leave no doubt.
        budget: of this frame.
        reach_m: how far from the camera to search.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    pictures = [
        budget.do(Step.PIXEL_EVIDENCE, pixel_evidence, scene, look, index, model, neighbours)
        for index in range(len(look.cameras))
    ]
    known = _on_support(last, support_heights_m)[None]
    others = budget.do(
        Step.PROPOSE_POSITIONS,
        proposed,
        scene,
        look,
        model,
        pictures,
        support_heights_m=support_heights_m,
        reach_m=reach_m,
    )
    places = np.concatenate([known, others])
    places = places[scene.support_planes.can_hold(places)]
    _, scores = budget.do(Step.SCORE_POSITIONS, scored, scene, look, model, pictures, places)
    if model.radius_m < patch_search.SMALL_M:
        apart_m = SLID * model.radius_m
        places = spread_out(places, scores.max(axis=1), apart=apart_m, limit=PLACES_SMALL)
        hypotheses = patch_search.hypotheses(scene, model, neighbours, places, budget=budget)
    else:
        chosen = places[np.argsort(-scores.max(axis=1), kind="stable")[:PLACES_NEARER]]
        nearer = (chosen[:, None] + _around(model)).reshape(-1, 3)
        nearer = nearer[scene.support_planes.can_hold(nearer)]
        yaws, scores = budget.do(Step.SCORE_NEARBY, scored, scene, look, model, pictures, nearer)
        starts = _starts_by_place(model, nearer, yaws, scores, limit=PLACES_REFINED)
        hypotheses = _large_object_hypotheses(
            scene, model, neighbours, starts, enough=enough, budget=budget
        )
    accepted = [g for g in hypotheses if _is_acceptable(g) and _can_be(scene, g.world_from_object)]
    return distinct(model, accepted)


def _large_object_hypotheses(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    starts: Sequence[Sequence[Pose]],
    *,
    enough: int,
    budget: FrameBudget,
) -> list[Hypothesis]:
    """What rough poses of a large object come to: of every place one, then more where it may be.

    Args:
        scene: the frame.
        model: the object.
        neighbours: other objects, whose places are taken.
        starts: by place, the likeliest yaw first.
        enough: it ends with so many poses that leave no doubt.
        budget: of this frame.
    """
    tried: list[tuple[Hypothesis, Evidence, Sequence[Pose]]] = []
    hypotheses: list[Hypothesis] = []

    def is_enough() -> bool:
        return len(distinct(model, [g for g in hypotheses if is_unambiguous(g.fit)])) >= enough

    for first, *others in starts:
        view = view_of(scene, model, first, at_any_yaw=True)
        evidence = budget.do(Step.GATHER, gather, scene, model, view, neighbours)
        hypotheses.append(budget.do(Step.REFINE, refined, scene, model, first, evidence))
        tried.append((hypotheses[-1], evidence, others))
        if is_enough():
            return hypotheses
    tried.sort(key=lambda item: -item[0].score)
    turned_starts = [
        (pose, evidence)
        for hypothesis, evidence, others in tried
        if not is_unambiguous(hypothesis.fit)
        for pose in others
    ]
    for pose, evidence in turned_starts[:REFINED_MORE]:
        hypotheses.append(budget.do(Step.REFINE, refined, scene, model, pose, evidence))
        tried.append((hypotheses[-1], evidence, ()))
        if is_enough():
            return hypotheses
    # A start may be too far off to come all the way.
    tried.sort(key=lambda item: -item[0].score)
    ambiguous = [
        (hypothesis, evidence)
        for hypothesis, evidence, _ in tried
        if not is_unambiguous(hypothesis.fit)
    ]
    for hypothesis, evidence in ambiguous[:REFINED_AGAIN]:
        again = hypothesis.world_from_object
        hypotheses.append(budget.do(Step.REFINE, refined, scene, model, again, evidence))
        if is_enough():
            break
    return hypotheses


def turned(model: TrackModel, evidence: Evidence, world_from_expected: Pose) -> list[Pose]:
    """Start poses of an object at any yaw about its expected position.

    The expected pose of a small object is among them, as only its colours score it.
    """
    free = np.maximum(evidence.foreground, evidence.hidden)
    own = evidence.own * (1.0 - evidence.hidden)
    picture = np.dstack([evidence.live, own, free]).astype(np.float32)
    places = world_from_expected.translation + _around(model)
    centres = places + model.centre_m
    camera, pose = evidence.camera, evidence.world_from_camera
    cuts = cut_out(picture, camera, pose, centres, model.radius_m)
    yaws = np.arange(YAWS) * (2 * math.pi / YAWS) + cuts.azimuth_rad[:, None]
    starts = _distinct_starts(
        model, places, yaws, template_scores(cuts, model), limit=REFINED_TURNED
    )
    return [world_from_expected, *starts] if patch_search.is_small(model, evidence) else starts


def ranked(scene: Scene, model: TrackModel, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses inside the room, each pose once, the best first."""
    return distinct(model, [g for g in hypotheses if scene.contains(g.world_from_object)])


def refined(
    scene: Scene,
    model: TrackModel,
    start_world_from_object: Pose,
    evidence: Evidence,
    *,
    quickly: bool = False,
) -> Hypothesis:
    """What a rough pose of an object comes to; of a small one, as its colours have it.

    Args:
        scene: the frame.
        model: the object.
        start_world_from_object: where to begin.
        evidence: its window.
        quickly: draw it no finer than what it is compared with, an object that moves.
    """
    if patch_search.is_small(model, evidence):
        return patch_search.refined(scene, model, evidence, start_world_from_object)
    prior = Prior(pose_vector(start_world_from_object), np.array(START_SIGMA))
    fit = solve(
        evidence,
        model,
        start_world_from_object,
        prior,
        scene.renderer,
        reaches_px=START_REACHES,
        cache=RenderingCache(quickly=quickly),
    )
    return Hypothesis(fit, None)


def _around(model: TrackModel) -> Points:
    """(N, 3) steps to the places around a place that are looked at more closely."""
    x, y = np.meshgrid(NEARER, NEARER)
    steps = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return np.asarray(model.radius_m * steps, dtype=np.float64)


def is_unambiguous(fit: Fit) -> bool:
    """Whether a pose's outline and surface are better than those of any wrong one."""
    return (
        not fit.textured
        and fit.contour_score >= UNAMBIGUOUS_CONTOUR_SCORE
        and fit.visible_fraction >= UNAMBIGUOUS_VISIBLE
    )


def _can_be(scene: Scene, world_from_object: Pose) -> bool:
    """Whether something at a pose is inside the room, and stands on something."""
    support_planes = bool(scene.support_planes.can_hold(world_from_object.translation[None])[0])
    return support_planes and scene.contains(world_from_object)


def _is_acceptable(hypothesis: Hypothesis) -> bool:
    """Whether a refined pose is a hypothesis."""
    fit = hypothesis.fit
    if hypothesis.photometric_score is not None:
        return hypothesis.score >= patch_search.ACCEPTED
    correlates = not fit.textured or fit.colour_correlation >= ACCEPTED_CORRELATION
    return (
        correlates
        and fit.edge_inlier_ratio >= ACCEPTED_INLIER_RATIO
        and fit.score >= ACCEPTED_SCORE
    )


def _on_support(last: Points, support_heights_m: Sequence[float]) -> Points:
    """A place on the nearest support."""
    return np.array([last[0], last[1], min(support_heights_m, key=lambda z: abs(z - last[2]))])


def _distinct_starts(
    model: TrackModel, places: Points, yaws: Points, scores: Points | FloatArray, *, limit: int
) -> list[Pose]:
    """The best-scored poses that differ from each other."""
    order = np.argsort(-scores, axis=None, kind="stable")
    order = order[scores.ravel()[order] > 0.0]
    rows, turns = order // scores.shape[1], yaws.ravel()[order]
    here = places[rows]
    left = np.ones(len(order), np.bool_)
    beside = np.zeros(len(order), np.int64)
    starts: list[Pose] = []
    while len(starts) < limit and left.any():
        index = int(np.argmax(left))
        starts.append(Pose.from_yaw(float(turns[index]), here[index]))
        near = ((here - here[index]) ** 2).sum(axis=1) < model.radius_m**2
        beside += near
        same = near & ~are_other_turns(model, turns - turns[index], least=1.5 * APART_RAD)
        left &= ~same & (beside < STARTS_A_PLACE)
        left[index] = False
    return starts


def _starts_by_place(
    model: TrackModel, places: Points, yaws: Points, scores: Points | FloatArray, *, limit: int
) -> list[list[Pose]]:
    """The best-scored poses of the best places, which are a radius apart, the best first."""
    starts = _distinct_starts(model, places, yaws, scores, limit=limit * STARTS_A_PLACE)
    by_place: list[list[Pose]] = []
    for start in starts:
        here = [group for group in by_place if apart(group[0], start) < model.radius_m]
        if here:
            here[0].append(start)
        else:
            by_place.append([start])
    return by_place[:limit]
