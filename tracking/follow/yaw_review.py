"""Yaw review: other yaws of an object are compared where the picture is ambiguous.

A chair seen from its side has a contour much like that of the same chair turned by half, and no
frame-to-frame solve corrects such an error.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from scenes.state import TrackState
from tracking.evidence.evidence import Evidence
from tracking.follow.posterior import LOST_CONFIDENCE, confidence_of, shows_pattern
from tracking.follow.track import PendingReview, Review, Task, Track
from tracking.hypotheses.budget import Step, steps_within
from tracking.hypotheses.hypothesis import Hypothesis, is_other
from tracking.hypotheses.room_search import is_unambiguous, ranked, refined, turned
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import Fit

COVERED = 0.35
"""Occluded share of the silhouette above which yaws are not compared. Chosen on the rooms lab and
desk."""


SEEN = 0.25
"""Visible fraction below which yaws are not compared. Chosen on the rooms lab and desk."""


REVIEW_PART = 2
"""One of so many parts of the time since the last measurement goes into a review. Chosen on the
rooms lab and desk."""

PERIOD_NS = 180_000_000
"""Least time in ns between two reviews. Chosen on the rooms lab and desk."""

MOST_IN_VAIN = 5
"""Most doublings of that period after reviews in vain."""


def reviewed(task: Task, evidence: Evidence, fit: Fit) -> tuple[Task, Fit]:
    """The task with its review recorded, and the fit or a clearly better one at another yaw.

    A review is spread over frames: each refines as many yaws as fit into its time, all in the frame
    in which the review began.

    Args:
        task: an object that may have turned.
        evidence: its window.
        fit: the fit at the prediction.
    """
    review, now = task.track.review, task.scene.frame.t_ns
    if not task.may_search:
        return task, fit
    if review is not None and review.pending is not None and _is_outdated(review.pending, task):
        review = replace(review, pending=None)
        task = replace(task, track=replace(task.track, review=review))
    pending = None if review is None else review.pending
    budget_ns = (now - task.track.looked_ns) // REVIEW_PART
    count = max(steps_within(task.costs, Step.REVIEW_YAW, budget_ns), 1)
    if pending is None:
        if not (_is_wanted(task, fit) and _is_due(review, now)):
            return task, fit
        starts = turned(task.model, evidence, fit.world_from_object)
        pending = PendingReview(task.scene, evidence, fit, tuple(starts), ())
        if count == 1:
            count = 0  # To compare all yaws from afar took about as long.
    pending = _advanced(task, pending, count)
    if pending.starts:
        in_vain, is_clear = (0, False) if review is None else (review.in_vain, review.is_clear)
        review = Review(now, in_vain, is_clear, pending)
        return replace(task, track=replace(task.track, review=review)), fit
    return _concluded(task, evidence, fit, pending)


def _is_outdated(pending: PendingReview, task: Task) -> bool:
    """Whether the camera's pose has changed since."""
    return pending.scene.world_from_rig is not task.scene.world_from_rig


def _advanced(task: Task, pending: PendingReview, count: int) -> PendingReview:
    """A review after some more poses were refined."""
    scene, quickly = pending.scene, task.track.moves_on
    more = tuple(
        task.costs.timed(
            Step.REVIEW_YAW,
            partial(refined, scene, task.model, start, pending.evidence, quickly=quickly),
        )[0]
        for start in pending.starts[:count]
    )
    return replace(pending, starts=pending.starts[count:], hypotheses=pending.hypotheses + more)


def _concluded(
    task: Task, evidence: Evidence, fit: Fit, pending: PendingReview
) -> tuple[Task, Fit]:
    """The task and the fit once all yaws are compared."""
    review, reviewed_pose = task.track.review, pending.fit.world_from_object
    same: list[Hypothesis] = []
    rivals: list[Hypothesis] = []
    for other in ranked(pending.scene, task.model, pending.hypotheses):
        is_rival = is_other(task.model, other.world_from_object, reviewed_pose)
        (rivals if is_rival else same).append(other)
    is_small = bool(same) and same[0].photometric_score is not None
    found = same[0] if is_small else Hypothesis(pending.fit, None)
    if same and same[0].is_clearly_better(found):
        found = same[0]
    is_wrong = bool(rivals) and rivals[0].is_clearly_better(found)
    best, others = (rivals[0], [found, *rivals[1:]]) if is_wrong else (found, rivals)
    is_clear = all(best.is_clearly_better(other) for other in others)
    in_vain = 0 if is_wrong or review is None else min(review.in_vain + 1, MOST_IN_VAIN)
    review = Review(task.scene.frame.t_ns, in_vain, is_clear)
    task = replace(task, track=replace(task.track, review=review))
    if pending.evidence is evidence:
        return task, best.fit
    if best.fit is pending.fit:
        return task, fit
    # What the frame of the review shows of the object has moved with it since.
    start = fit.world_from_object @ (reviewed_pose.inverse() @ best.world_from_object)
    return task, refined(task.scene, task.model, start, evidence).fit


def is_under_review(track: Track) -> bool:
    """Whether a review of a track is pending."""
    return track.review is not None and track.review.pending is not None


def was_reviewed(track: Track, t_ns: int) -> bool:
    """Whether a track's review was worked on in the frame of this time."""
    return track.review is not None and track.review.t_ns == t_ns


def reported_confidence(track: Track, fit: Fit) -> float:
    """Confidence in a pose: low while its yaw is ambiguous."""
    confidence = confidence_of(fit)
    if track.review is None or track.review.is_clear or is_unambiguous(fit):
        return confidence
    return min(confidence, LOST_CONFIDENCE)


def _is_wanted(task: Task, fit: Fit) -> bool:
    """Whether the yaw may be wrong, and the picture may decide."""
    if task.model.symmetry == ROUND or is_unambiguous(fit):
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
