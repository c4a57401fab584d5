"""One object from frame to frame: rest, motion, occlusion and loss."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.evidence.evidence import Evidence, gather, view_of
from tracking.evidence.observation import observe
from tracking.follow.belief import (
    Belief,
    accounts_for,
    accounts_for_change,
    at_first,
    at_pose,
    is_at_rest_still,
    is_followed,
    is_on_a_passer_by,
    is_shaken,
    is_sure,
    shows_as_usual,
    support_at,
    weigh_measurement,
)
from tracking.follow.carried import is_lifted
from tracking.follow.local_search import climb_beside
from tracking.follow.measure import Seen, measure
from tracking.follow.outcome import accept, lose, miss, settle
from tracking.follow.track import Task, Track
from tracking.follow.yaw_review import is_under_review, review_yaw
from tracking.hypotheses.budget import Step
from tracking.hypotheses.hypothesis import CLEAR_NATS, is_other
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import Fit
from tracking.solve.motion import Motion, pose_vector

MOVED_M = 0.010
"""Displacement in m from which a resting object has moved. Chosen on the rooms lab and desk."""

MOVED_RAD = math.radians(2.0)
"""Turn in rad from which a resting object has moved. Chosen on the rooms lab and desk."""


ELSEWHERE_M = 0.03
"""Displacement in m from the scan's pose from which an object was moved between sessions. Chosen on
the rooms lab and desk."""


COMPARED_SHARE = (0.25, 0.05)
"""Shares of the time that comparing an object's pose with those beside it may take, where it is in
doubt and where it shows as usual: in each of ten pictures a second, or in every fourth of them. In
all of thirty, two chairs that moved took 180 ms a picture for 57."""

SIGNIFICANT = 2.5
"""Standard deviations of the solve that a resting object must exceed to have moved."""


def follow(task: Task, unchanged: bool) -> Track:
    """The object's track after this frame.

    Args:
        task: the object and the frame.
        unchanged: result of `first_look`.
    """
    track, now = task.track, task.scene.frame.t_ns
    if unchanged and not task.is_turn and not is_under_review(track):
        # What is seen to rest is known to be there: its next way begins now.
        known_ns = now if accounts_for(track, track.rate) else track.known_ns
        sure_ns = now if is_sure(track.rate) else track.sure_ns
        rests = Motion.rest(now)
        return replace(track, motion=rests, seen_ns=now, known_ns=known_ns, sure_ns=sure_ns)
    if track.state is TrackState.LOST:
        if task.is_first or not _shows_at(task, track.world_from_object):
            return track if task.is_first else _back(task)
        # Somebody stood before it, and it was believed gone.
        track = replace(track, state=TrackState.OCCLUDED, motion=Motion.rest(now))
        task = replace(task, track=track)
    predicted_world_from_object = track.motion.predict(track.world_from_object, now)
    evidence = gather(
        task.scene,
        task.model,
        view_of(task.scene, task.model, predicted_world_from_object),
        task.neighbours,
    )
    window = Seen(evidence, observe(task.scene, evidence))
    window, fit = measure(task, window, predicted_world_from_object, is_unchanged=unchanged)
    evidence, belief = window.evidence, weigh_measurement(task, window.observation, fit)
    if task.is_first:
        first = at_first(task, evidence, belief)
        if first is None:
            return lose(task, belief)
        belief = first
        if not _is_elsewhere(track, belief.fit):
            correlation = max(belief.fit.colour_correlation, 0.0)
            track = replace(track, initial_correlation=correlation)
            task = replace(task, track=track)
    if belief.is_unseen:
        return miss(task, belief)
    if task.is_first:
        rests = not _has_moved(task, belief.fit, unchanged=unchanged)
        return accept(task, evidence, belief, rests=rests, unchanged=unchanged)
    return _decided(
        task,
        belief,
        evidence=evidence,
        predicted_world_from_object=predicted_world_from_object,
        unchanged=unchanged,
    )


def _decided(
    task: Task,
    belief: Belief,
    *,
    evidence: Evidence,
    predicted_world_from_object: Pose,
    unchanged: bool,
) -> Track:
    """The track by a measurement that is not the first: at rest, followed, taken back or missed."""
    track, now = task.track, task.scene.frame.t_ns
    if track.was_at_rest and _is_where_it_rested(task, belief, unchanged=unchanged):
        return _at_rest(task, evidence, belief, unchanged=unchanged)
    if _is_comparison_due(task, belief):
        task = replace(task, track=replace(track, compared_ns=now))
        back = (
            task.track if track.was_at_rest else _back(task, min_nats=max(belief.found.nats, 0.0))
        )
        if back is not task.track:
            return back
        belief = _climbed(
            task,
            belief,
            evidence=evidence,
            predicted_world_from_object=predicted_world_from_object,
        )
    belief = _again(task, belief, evidence=evidence)
    belief = _unless_it_stayed(task, belief, evidence=evidence)
    task, belief = _reviewed(task, belief, evidence=evidence)
    if is_followed(task.track, belief):
        return accept(task, evidence, belief, rests=False, unchanged=unchanged)
    return miss(task, belief)


def _is_where_it_rested(task: Task, belief: Belief, *, unchanged: bool) -> bool:
    """Whether what was at rest is likelier to be there than where it was measured.

    What moved is in no doubt where it is now, or leaves the empty room behind.
    """
    track, rate = task.track, belief.found.nats_a_sample
    if is_on_a_passer_by(track, belief):
        return True
    has_gone = belief.before.nats < -CLEAR_NATS and accounts_for(track, rate)
    if not has_gone and not is_sure(rate) and not shows_as_usual(track, rate):
        return True
    is_doubtful = unchanged or not _has_moved(task, belief.fit, unchanged=unchanged)
    return is_at_rest_still(task, belief, is_doubtful=is_doubtful)


def _is_comparison_due(task: Task, belief: Belief) -> bool:
    """Whether poses beside an object's, and the one at which it stood, are compared again."""
    # What was followed wrongly for long shows as usual, too.
    share = COMPARED_SHARE[shows_as_usual(task.track, belief.found.nats_a_sample)]
    waited_ns = task.scene.frame.t_ns - task.track.compared_ns
    wait_ns = task.costs.cost_ms(Step.BESIDE) / share * 1e6
    # A picture comes a little early or late.
    return task.may_compare and waited_ns >= 0.9 * wait_ns


def _shows_at(task: Task, world_from_object: Pose, *, min_nats: float = 0.0) -> bool:
    """Whether an object clearly shows at a pose, by `CLEAR_NATS` more than `min_nats`."""
    support = support_at(task, world_from_object)
    return support.nats > min_nats + CLEAR_NATS and not support.is_covered


def _back(task: Task, *, min_nats: float = 0.0) -> Track:
    """The track at the place where the object stood before, if it clearly shows there again.

    What was dragged along with a passer-by, or lost, may be where it last was in plain sight.
    """
    track, now = task.track, task.scene.frame.t_ns
    stood = track.world_from_stood
    if stood is None or not is_other(task.model, stood, track.world_from_object):
        return track
    if not _shows_at(task, stood, min_nats=min_nats):
        return track
    back = replace(
        track,
        world_from_object=stood,
        motion=Motion.rest(now),
        state=TrackState.OCCLUDED,
        was_at_rest=True,
        rest=None,
        reduced=None,
    )
    return follow(replace(task, track=back), unchanged=False)


def _corrected(task: Task, before: Fit, after: Fit) -> Task:
    """The task with its last pose corrected as its pose now: an error found is no motion."""
    correction = before.world_from_object.inverse() @ after.world_from_object
    track = replace(task.track, world_from_object=task.track.world_from_object @ correction)
    return replace(task, track=track)


def _at_rest(task: Task, evidence: Evidence, belief: Belief, *, unchanged: bool) -> Track:
    """The track of an object that is likelier where it rested than where it was measured."""
    is_hidden = task.track.state is not TrackState.STATIC
    if is_shaken(task.track, belief) and not unchanged and not is_hidden:
        task, fit = review_yaw(task, evidence, belief, is_shaken=True)
        if fit is not belief.fit:
            turned = weigh_measurement(task, belief.observation, fit)
            shows = shows_as_usual(task.track, turned.found.nats_a_sample)
            if shows and accounts_for_change(task, turned):
                return accept(task, evidence, turned, rests=False, unchanged=False)
    before = belief.before
    is_seen = accounts_for(task.track, before.nats_a_sample) or not is_hidden
    # Once the camera has moved no patches say that nothing changed: that is only likely.
    has_gone = task.track.rest is None and before.nats < -CLEAR_NATS
    if has_gone or not (unchanged or (before.nats >= CLEAR_NATS and is_seen)):
        return miss(task, belief)
    if _has_moved(task, belief.fit, unchanged=unchanged):
        belief = at_pose(task, evidence, belief, task.track.world_from_object)
    return accept(task, evidence, belief, rests=True, unchanged=unchanged)


def _has_moved(task: Task, fit: Fit, *, unchanged: bool) -> bool:
    """Whether a resting object was measured farther off than its measurements scatter."""
    step = pose_vector(fit.world_from_object) - pose_vector(task.track.world_from_object)
    step[3] = 0.0 if task.model.symmetry == ROUND else wrap_angle(float(step[3]))
    sigma = np.sqrt(np.diag(fit.covariance))
    far = max(MOVED_M, SIGNIFICANT * float(np.linalg.norm(sigma[:2])))
    turned = max(MOVED_RAD, SIGNIFICANT * float(sigma[3]))
    stays = float(np.linalg.norm(step[:3])) < far and abs(float(step[3])) < turned
    return not stays or not (unchanged or not _was_taken_up(task, fit))


def _is_elsewhere(track: Track, fit: Fit) -> bool:
    """Whether an object was found clearly beside its place: what moved it may have turned it."""
    apart = pose_vector(fit.world_from_object) - pose_vector(track.world_from_object)
    return float(np.linalg.norm(apart[:3])) > ELSEWHERE_M


def _was_taken_up(task: Task, fit: Fit) -> bool:
    """Whether a standing object is now lifted; from afar its distance is too uncertain."""
    stood = not is_lifted(task, task.track.world_from_object)
    return stood and is_lifted(task, fit.world_from_object)


def _climbed(
    task: Task, belief: Belief, *, evidence: Evidence, predicted_world_from_object: Pose
) -> Belief:
    """The belief, climbed to what is likelier beside a moving object's measured pose."""
    if task.track.state is not TrackState.TRACKED:
        return belief
    climbed, _ = task.costs.timed(
        Step.BESIDE,
        lambda: climb_beside(
            task,
            belief,
            evidence=evidence,
            predicted_world_from_object=predicted_world_from_object,
        ),
    )
    return climbed


def _again(task: Task, belief: Belief, *, evidence: Evidence) -> Belief:
    """The belief, refined anew where it shows too little.

    What was hidden already and still does not show is looked for around its prediction, a part in
    each frame: refined in all of them it takes 50 ms a frame, and goes, where it goes, to poses
    that show as little, up to 47 cm away.
    """
    track, nats = task.track, belief.found.nats
    is_hidden = track.missed_frames > 0 and nats <= CLEAR_NATS
    open_share = 1.0 - belief.found.unknown_fraction
    if is_hidden or nats > open_share * track.usual_nats - CLEAR_NATS:
        return belief
    settled = settle(task, evidence, belief)
    return belief if settled is belief.fit else weigh_measurement(task, belief.observation, settled)


def _unless_it_stayed(task: Task, belief: Belief, *, evidence: Evidence) -> Belief:
    """The belief, or that in the last pose if the measured one is elsewhere and less likely.

    What is seen against a plain surface may be as large and farther, or smaller and nearer: a book
    that somebody had put down went 13 cm up towards the camera, and stayed there. What is nearer
    covers more pixels: as likely is it only where it shows as much in each.
    """
    last = task.track.world_from_object
    if not is_other(task.model, belief.fit.world_from_object, last):
        return belief
    before, found = belief.before, belief.found
    found_nats = found.nats * before.samples / max(found.samples, before.samples, 1.0)
    stays = before.nats > max(found_nats, 0.0) and not before.is_covered
    return at_pose(task, evidence, belief, last) if stays else belief


def _reviewed(task: Task, belief: Belief, *, evidence: Evidence) -> tuple[Task, Belief]:
    """The task and the belief after a review of the object's yaw, if one is due."""
    task, fit = review_yaw(task, evidence, belief)
    if fit is belief.fit:
        return task, belief
    task = _corrected(task, belief.fit, fit)
    return task, weigh_measurement(task, belief.observation, fit)
