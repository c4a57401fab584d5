"""Yaw review: other yaws of an object are compared where the picture is ambiguous.

A chair seen from its side has a contour much like that of the same chair turned by half, and no
frame-to-frame solve corrects such an error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from scenes.state import TrackState
from tracking.evidence.evidence import Evidence
from tracking.follow.belief import MOVED_NATS, Belief, among_near_poses, hypothesis_of
from tracking.follow.posterior import shows_pattern
from tracking.follow.track import PendingReview, Review, Task, Track
from tracking.hypotheses.budget import BudgetExhausted, FrameBudget, Step
from tracking.hypotheses.hypothesis import APART_RAD, Hypothesis, distinct, is_other
from tracking.hypotheses.refinement import refine
from tracking.hypotheses.yaws import likeliest_yaws
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import Fit

COVERED = 0.35
"""Occluded share of the silhouette above which yaws are not compared. Chosen on the rooms lab and
desk."""


SEEN = 0.25
"""Visible fraction below which yaws are not compared. Chosen on the rooms lab and desk."""


REVIEW_PART = 4
"""One of so many parts of the stream's frame interval goes into a review, by nominal costs, of
which true ones are twice as much. With half of it, reviews took 95 to 140 ms of the slowest frames
of the default rehearsal, with a quarter 25 to 50; errors were the same."""

PERIOD_NS = 180_000_000
"""Least time in ns between two reviews. Chosen on the rooms lab and desk."""

MAX_IN_VAIN = 5
"""Most doublings of that period after reviews in vain."""

TURNED_NATS = MOVED_NATS + math.log(math.pi / APART_RAD)
"""Log odds that an object whose yaw was known was not turned on the spot to one certain other: that
it was not moved, times the number of yaws that can be distinguished."""


def review_yaw(
    task: Task, evidence: Evidence, belief: Belief, *, is_shaken: bool = False
) -> tuple[Task, Fit]:
    """The task with its review recorded, and the fit or a clearly likelier one at another yaw.

    A review is spread over frames, each of which does some of its steps, all in the frame in which
    the review began.

    Args:
        task: an object that may have turned.
        evidence: its window.
        belief: the measurement at the prediction.
        is_shaken: whether it rests, and its place speaks less for it than before.
    """
    fit, review, now = belief.fit, task.track.review, task.scene.frame.t_ns
    if not task.may_search:
        return task, fit
    if review is not None and review.pending is not None and _is_outdated(review.pending, task):
        review = replace(review, pending=None)
        task = replace(task, track=replace(task.track, review=review))
    pending = None if review is None else review.pending
    if pending is None:
        if not ((is_shaken or _is_wanted(task, fit)) and _is_due(review, now)):
            return task, fit
        among = among_near_poses(task, belief)
        pending = PendingReview(task.scene, evidence, among.observation, fit, among.found, ())
    part_ms = task.interval_ns / REVIEW_PART / 1e6
    budget = FrameBudget(part_ms, pending.done, task.costs)
    try:
        others = _others(task, pending, budget)
    except BudgetExhausted:
        # Until they are compared, another yaw is as likely.
        in_vain = 0 if review is None else review.in_vain
        pending = replace(pending, done=budget.done())
        review = Review(now, in_vain, 0.0, task.track.known_nats, pending)
        return replace(task, track=replace(task.track, review=review)), fit
    return _concluded(task, evidence, belief, pending, others)


def _is_outdated(pending: PendingReview, task: Task) -> bool:
    """Whether the camera's pose has changed since."""
    return pending.scene.world_from_rig is not task.scene.world_from_rig


def _others(task: Task, pending: PendingReview, budget: FrameBudget) -> list[Hypothesis]:
    """Other yaws, refined in the frame in which the review began.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    evidence, pose = pending.evidence, pending.fit.world_from_object
    starts = budget.do(Step.YAWS, likeliest_yaws, task.model, evidence, pose)
    return [
        refine(
            pending.scene,
            task.model,
            start,
            evidence,
            pending.observation,
            quickly=task.track.moves_on,
            budget=budget,
        )
        for start in starts
    ]


def _concluded(
    task: Task,
    evidence: Evidence,
    belief: Belief,
    pending: PendingReview,
    others: Sequence[Hypothesis],
) -> tuple[Task, Fit]:
    """The task and the fit once all yaws are compared."""
    review, reviewed_pose = task.track.review, pending.fit.world_from_object
    found = Hypothesis(pending.fit, pending.support)
    inside = [g for g in others if pending.scene.contains(g.world_from_object)]
    rivals = [
        other
        for other in distinct(task.model, inside)
        if is_other(task.model, other.world_from_object, reviewed_pose)
    ]
    known = task.track.known_nats
    found = replace(found, log_prior=min(max(known, 0.0), TURNED_NATS))
    is_wrong = bool(rivals) and rivals[0].is_clearly_better(found)
    best, less = (rivals[0], [found, *rivals[1:]]) if is_wrong else (found, rivals)
    rival_nats = min((best.log_odds - other.log_odds for other in less), default=math.inf)
    in_vain = 0 if is_wrong or review is None else min(review.in_vain + 1, MAX_IN_VAIN)
    review = Review(task.scene.frame.t_ns, in_vain, rival_nats, rival_nats)
    task = replace(task, track=replace(task.track, review=review))
    if not is_wrong:
        return task, belief.fit
    if pending.evidence is evidence:
        return task, best.fit
    # What the frame of the review shows of the object has moved with it since.
    start = belief.fit.world_from_object @ (reviewed_pose.inverse() @ best.world_from_object)
    among = among_near_poses(task, belief)
    again = refine(task.scene, task.model, start, evidence, among.observation)
    return task, max(again, hypothesis_of(among), key=lambda other: other.support.nats).fit


def is_under_review(track: Track) -> bool:
    """Whether a review of a track is pending."""
    return track.review is not None and track.review.pending is not None


def was_reviewed(track: Track, t_ns: int) -> bool:
    """Whether a track's review was worked on in the frame of this time."""
    return track.review is not None and track.review.t_ns == t_ns


def _is_wanted(task: Task, fit: Fit) -> bool:
    """Whether the yaw may be wrong, and the picture may decide."""
    if task.model.symmetry == ROUND:
        return False
    review = task.track.review
    if _was_found_by_appearance(fit) and shows_pattern(fit) and (review is None or review.is_clear):
        return False
    if fit.covered_fraction > COVERED or fit.visible_fraction < SEEN:
        return False
    # What never moved has the yaw that it was scanned with.
    return task.track.state is not TrackState.STATIC or review is not None


def _was_found_by_appearance(fit: Fit) -> bool:
    """Whether a pose was found by the remembered appearance, which fixes its yaw."""
    reduced = fit.reduced
    return (
        reduced.appearance is not None
        and reduced.appearance.view_weight(reduced.camera_from_object) > 0.5
    )


def _is_due(review: Review | None, now_ns: int) -> bool:
    return review is None or now_ns - review.t_ns >= PERIOD_NS << review.in_vain
