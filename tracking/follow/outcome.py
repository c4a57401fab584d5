"""The track after a frame: a measurement is accepted or missed, the object lost, or just held."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import wrap_angle
from scenes.state import TrackState
from tracking.evidence.appearance_memory import AppearanceMemory, remember_appearance
from tracking.evidence.evidence import Evidence
from tracking.evidence.rendering import RenderingCache, draw
from tracking.follow.belief import (
    STAYS_NATS,
    Belief,
    accounts_for,
    among_near_poses,
    confidence_of,
    hypothesis_of,
    is_sure,
    was_shown,
)
from tracking.follow.carried import is_lifted
from tracking.follow.measure import at_remembered_pose
from tracking.follow.posterior import CARRIED_SIGMA_M, RECOGNISED_CORRELATION, is_heavy
from tracking.follow.rest import around, has_stirred, rest_of
from tracking.follow.track import RESTING_FRAMES, SEARCH_PERIOD_NS, Task, Track
from tracking.hypotheses.hypothesis import CLEAR_NATS
from tracking.hypotheses.refinement import START_SIGMA, refine
from tracking.likelihood.pixel_model import PoseSupport
from tracking.model.symmetry import ROUND
from tracking.solve.covariance import uncertainty
from tracking.solve.gauss_newton import Fit
from tracking.solve.motion import Motion, pose_vector, vector_pose

RESTING_STEP_M = 0.005
"""Step in m per frame below which an object counts as still. Chosen on the rooms lab and desk."""

RESTING_STEP_RAD = math.radians(0.7)
"""The same in rad. Chosen on the rooms lab and desk."""

REST_BLEND = 0.2
"""Weight of a new measurement in a resting object's pose. Chosen on the rooms lab and desk."""

UNCOVERED = 0.05
"""Occluded share of the silhouette up to which an appearance is remembered. Chosen on the rooms lab
and desk."""

RENEWED_BELOW_WEIGHT = 0.9
"""View weight, 0..1, of the remembered appearance below which a new one is recorded. Chosen on the
rooms lab and desk."""

KEPT_SHARE = 0.8
"""Share of its usual support that a moving object keeps from one frame to the next: it may turn and
go away, over some five frames."""

RATE_KEPT = 0.95
"""Share of its usual nats a sample that a moving object keeps from one frame to the next: from
another side it may show less."""

FORGOTTEN = 0.15
"""Weight of a frame's lower value in the running inlier ratio and correlation. Chosen on the rooms
lab and desk."""

HELD_SIGMA = np.array([0.03, 0.03, 0.002, math.radians(3)])
"""(4,) growth per frame of the standard deviation of what is hidden, or of what moved while nobody
knows where the camera is: metres, radians."""

COASTED_FRAMES = 4
"""Frames without measurement for which a carried object keeps its velocity. Chosen on the rooms lab
and desk."""


def accept(
    task: Task, evidence: Evidence, belief: Belief, *, rests: bool, unchanged: bool
) -> Track:
    """The track after an accepted measurement.

    Args:
        task: the object and the frame.
        evidence: its window.
        belief: the measurement.
        rests: whether it did not move.
        unchanged: whether its pixels did not change.
    """
    track, now, fit = task.track, task.scene.frame.t_ns, belief.fit
    step = _step_of(task, fit)
    distance, turn = float(np.linalg.norm(step[:3])), abs(float(step[3]))
    seen = _see(task, belief, rests=rests)
    if track.was_at_rest and rests:
        rested = _rest_on(task, evidence, seen, fit, step=step, unchanged=unchanged)
        return _know(rested, belief.found, now_ns=now)
    still = distance < RESTING_STEP_M and turn < RESTING_STEP_RAD
    still_frames = track.still_frames + 1 if still else 0
    if still_frames >= RESTING_FRAMES:
        fit = settle(task, evidence, belief)
        settled = replace(
            seen,
            world_from_object=fit.world_from_object,
            world_from_stood=fit.world_from_object,
            motion=Motion.rest(now),
            state=TrackState.STATIC,
            was_at_rest=True,
            still_frames=still_frames,
            rest=rest_of(task, fit),
            appearance=_appearance(task, evidence, fit),
        )
        return _know(settled, belief.found, now_ns=now)
    motion = track.motion.measured(track.world_from_object, fit.world_from_object, now)
    if task.is_first or track.missed_frames > 3:
        motion = Motion.rest(now)
    moved = replace(
        seen,
        world_from_object=fit.world_from_object,
        motion=motion,
        state=TrackState.TRACKED,
        was_at_rest=False,
        still_frames=still_frames,
        rest=None,
        appearance=_appearance_in_motion(task, evidence, fit),
    )
    return _know(moved, belief.found, now_ns=now)


def _step_of(task: Task, fit: Fit) -> NDArray[np.float64]:
    """(4,) m and rad from an object's last pose to a fit; round objects do not turn."""
    step = pose_vector(fit.world_from_object) - pose_vector(task.track.world_from_object)
    step[3] = 0.0 if task.model.symmetry == ROUND else wrap_angle(float(step[3]))
    return step


def _see(task: Task, belief: Belief, *, rests: bool) -> Track:
    """The track of an object that was seen: all but its pose, state and motion is of this frame."""
    track, fit = task.track, belief.fit
    stays_nats = STAYS_NATS if belief.found.nats > CLEAR_NATS else track.stays_nats
    seen = replace(
        track,
        covariance=uncertainty(task.scene, task.model, fit),
        visible_fraction=fit.visible_fraction,
        confidence=confidence_of(belief.found, track.rival_nats, stays_nats=stays_nats),
        stays_nats=stays_nats,
        usual_inlier_ratio=_usual(track.usual_inlier_ratio, fit.unoccluded_inlier_ratio),
        usual_correlation=_usual(track.usual_correlation, fit.colour_correlation),
        missed_frames=0,
        seen_ns=task.scene.frame.t_ns,
        reduced=fit.reduced,
        rate=belief.found.nats_a_sample,
    )
    if rests and not belief.found.is_covered and belief.found.nats > CLEAR_NATS:
        seen = replace(seen, world_from_stood=track.world_from_object)
    kept = 1.0 if rests else KEPT_SHARE
    return replace(seen, usual_nats=max(kept * track.usual_nats, belief.found.nats))


def _know(track: Track, support: PoseSupport, *, now_ns: int) -> Track:
    """The track with its pose as the latest known one, if that accounts for what is seen."""
    rate = support.nats_a_sample
    kept = 1.0 if track.was_at_rest else RATE_KEPT
    if support.is_covered or not accounts_for(track, rate):
        return track
    return replace(
        track,
        sure_ns=now_ns if is_sure(rate) else track.sure_ns,
        usual_rate=max(rate, kept * track.usual_rate),
        world_from_known=track.world_from_object,
        known_ns=now_ns,
        known_motion=track.motion,
    )


def _rest_on(
    task: Task,
    evidence: Evidence,
    seen: Track,
    fit: Fit,
    *,
    step: NDArray[np.float64],
    unchanged: bool,
) -> Track:
    """The track of an object that rests on: its pose blends in the measurement, `step` away."""
    track = task.track
    blend = REST_BLEND if fit.visible_fraction > 0.85 and track.rest is not None else 0.0
    world_from_object = vector_pose(pose_vector(track.world_from_object) + blend * step)
    # What begins to leave is not where it was: it would be remembered wrongly.
    is_quiet = unchanged or track.appearance is None
    memory = track.appearance
    is_remembered = memory is not None and memory.is_valid_at(world_from_object)
    if is_quiet and not is_remembered:
        memory = _appearance(task, evidence, replace(fit, world_from_object=world_from_object))
    return replace(
        seen,
        world_from_object=world_from_object,
        motion=Motion.rest(task.scene.frame.t_ns),
        state=TrackState.STATIC,
        rest=rest_of(task, fit),
        appearance=memory,
    )


def _usual(before: float, now: float) -> float:
    """Running value that follows increases at once and decreases slowly."""
    return max(now, (1.0 - FORGOTTEN) * before + FORGOTTEN * now)


def settle(task: Task, evidence: Evidence, belief: Belief) -> Fit:
    """The fit of an object that comes to rest, or a likelier one that it refines to."""
    belief = among_near_poses(task, belief)
    start, observation = belief.fit.world_from_object, belief.observation
    x, y, z, yaw = START_SIGMA
    is_carried = is_lifted(task, start)
    sigma = (x, y, CARRIED_SIGMA_M if is_carried else z, yaw)
    again = refine(task.scene, task.model, start, evidence, observation, sigma=sigma)
    return again.fit if again.is_clearly_better(hypothesis_of(belief)) else belief.fit


def _appearance_in_motion(task: Task, evidence: Evidence, fit: Fit) -> AppearanceMemory | None:
    """Remembered appearance of a moving object, kept until the object turns away from it."""
    kept = task.track.appearance
    made = _appearance(task, evidence, fit) if _turns_away_from_memory(fit) else kept
    return kept if made is kept or made is None else replace(made, was_at_rest=False)


def _turns_away_from_memory(fit: Fit) -> bool:
    """Whether an object is recognised by its remembered appearance and begins to turn away."""
    appearance = fit.reduced.appearance
    if appearance is None or fit.colour_correlation < RECOGNISED_CORRELATION:
        return False
    return 0.0 < appearance.view_weight(fit.reduced.camera_from_object) < RENEWED_BELOW_WEIGHT


def _appearance(task: Task, evidence: Evidence, fit: Fit) -> AppearanceMemory | None:
    """Appearance of a textured object at rest, if nothing occludes it."""
    model = task.model
    if not model.textured or fit.covered_fraction > UNCOVERED:
        return task.track.appearance
    pose, renderer = fit.world_from_object, task.scene.renderer
    drawn = draw(model, pose, evidence, renderer)
    appearance = remember_appearance(evidence, drawn, pose, radius_m=model.radius_m)
    return replace(
        appearance,
        colour_correlation=at_remembered_pose(
            task, evidence, RenderingCache(None, appearance), appearance
        ).colour_correlation,
    )


def miss(task: Task, belief: Belief) -> Track:
    """The track after a frame without an accepted measurement: held where it was, or lost."""
    track, now = task.track, task.scene.frame.t_ns
    missed = track.missed_frames + 1
    is_carried = not is_heavy(task, track.world_from_object)
    grown = track.covariance + np.diag(HELD_SIGMA**2)
    held = replace(
        track,
        covariance=grown,
        visible_fraction=belief.before.open_fraction * belief.before.matched_fraction,
        confidence=confidence_of(belief.before, track.rival_nats, stays_nats=track.stays_nats),
        missed_frames=missed,
        missing_ns=_missing_since(task, belief),
        around=None if was_shown(track) else around(belief),
        still_frames=0,
        state=TrackState.OCCLUDED,
        motion=track.motion if is_carried and missed <= COASTED_FRAMES else Motion.rest(now),
        rest=None,
    )
    return lose(replace(task, track=held), belief) if belief.has_left and missed >= 2 else held


def lose(task: Task, belief: Belief) -> Track:
    """The track of an object that has to be searched for."""
    track, review = task.track, task.track.review
    return replace(
        track,
        review=None if review is None else replace(review, pending=None),
        state=TrackState.LOST,
        confidence=confidence_of(belief.before, track.rival_nats, stays_nats=track.stays_nats),
        visible_fraction=belief.before.open_fraction * belief.before.matched_fraction,
        missed_frames=track.missed_frames + 1,
        missing_ns=track.missing_ns if track.missed_frames else task.scene.frame.t_ns,
        still_frames=0,
        motion=Motion.rest(task.scene.frame.t_ns),
        rest=None,
        looked_ns=track.seen_ns,
        searched_ns=task.scene.frame.t_ns - SEARCH_PERIOD_NS,
        searches_in_vain=0,
    )


def _missing_since(task: Task, belief: Belief) -> int:
    """Frame time of the first picture without an object that was known in the one before it.

    Of what has never clearly shown, the latest in which nothing moved around its place.
    """
    track, now = task.track, task.scene.frame.t_ns
    if was_shown(track):
        was_there = track.missed_frames == 0 and track.known_ns == track.seen_ns
    else:
        was_there = track.missed_frames == 0 or not has_stirred(track.around, around(belief))
    return now if was_there else track.missing_ns


def hold(track: Track, now_ns: int) -> Track:
    """The track after a frame of unknown camera pose: what moved is held, unseen."""
    if track.state is not TrackState.TRACKED:
        return replace(track, motion=Motion.rest(now_ns))
    return replace(
        track,
        covariance=track.covariance + np.diag(HELD_SIGMA**2),
        state=TrackState.OCCLUDED,
        missed_frames=track.missed_frames + 1,
        still_frames=0,
        motion=Motion.rest(now_ns),
        rest=None,
    )


def see_anew(track: Track) -> Track:
    """The track of an object that is seen from elsewhere now: place kept, patches not.

    Its remembered appearance is still a good one, but no longer of the same pixels.
    """
    memory = track.appearance
    moved = None if memory is None else replace(memory, was_at_rest=False)
    return replace(track, rest=None, appearance=moved)
