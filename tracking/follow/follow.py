"""One object from frame to frame: rest, motion, occlusion and loss."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.evidence.appearance_memory import AppearanceMemory, remember_appearance
from tracking.evidence.evidence import Evidence, gather, view_of
from tracking.evidence.observation import observe
from tracking.evidence.rendering import RenderingCache, draw
from tracking.follow.belief import (
    Belief,
    accounts_for_change,
    at_first,
    at_pose,
    believed,
    confidence_of,
    hypothesis_of,
    is_at_rest_still,
    is_followed,
    is_on_a_passer_by,
    is_shaken,
)
from tracking.follow.carried import is_lifted
from tracking.follow.measure import Seen, at_remembered_pose, measure
from tracking.follow.posterior import CARRIED_SIGMA_M, HEAVY_HEIGHT_M, RECOGNISED_CORRELATION
from tracking.follow.track import RESTING_FRAMES, SEARCH_PERIOD_NS, Rest, Task, Track
from tracking.follow.yaw_review import is_under_review, reviewed
from tracking.hypotheses.hypothesis import CLEAR_NATS, is_other
from tracking.hypotheses.refinement import START_SIGMA, refined
from tracking.kernels import native
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.symmetry import ROUND
from tracking.solve.covariance import uncertainty
from tracking.solve.gauss_newton import Fit
from tracking.solve.motion import Motion, pose_vector, vector_pose

CHANGED_LEVEL = 0.055
"""Colour difference (channel of 0..1) of a changed patch. Chosen on the rooms lab and desk."""

CHANGED_SHARE = 0.02
"""Share of changed patches from which a resting object is measured again. Chosen on the rooms lab
and desk."""


PATCH_PX = 5
"""Side in px of the patches compared at rest."""


BESIDE_PX = 6.0
"""Distance in px outside the contour of the patches around an object."""

BESIDE_STEP = 4
"""Contour points per patch around an object."""


RESTING_STEP_M = 0.005
"""Step in m per frame below which an object counts as still. Chosen on the rooms lab and desk."""

RESTING_STEP_RAD = math.radians(0.7)
"""The same in rad. Chosen on the rooms lab and desk."""


MOVED_M = 0.010
"""Displacement in m from which a resting object has moved. Chosen on the rooms lab and desk."""

MOVED_RAD = math.radians(2.0)
"""Turn in rad from which a resting object has moved. Chosen on the rooms lab and desk."""


ELSEWHERE_M = 0.03
"""Displacement in m from the scan's pose from which an object was moved between sessions. Chosen on
the rooms lab and desk."""


SIGNIFICANT = 2.5
"""Standard deviations of the solve that a resting object must exceed to have moved."""


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

FORGOTTEN = 0.15
"""Weight of a frame's lower value in the running inlier ratio and correlation. Chosen on the rooms
lab and desk."""


COASTED_FRAMES = 4
"""Frames without measurement for which a carried object keeps its velocity. Chosen on the rooms lab
and desk."""


def first_look(task: Task) -> bool:
    """Whether a resting object's patches are unchanged, so that nothing needs to be solved."""
    rest, track = task.track.rest, task.track
    if rest is None or track.state is not TrackState.STATIC or rest.inside == 0:
        return False
    apart = _colours_at(task, rest.lens, rest.corners) - rest.colours
    # Exposure drifts equally everywhere; changes are deviations from the median.
    apart = np.abs(apart - np.median(apart, axis=0))[: rest.inside]
    return float((apart.max(axis=1) > CHANGED_LEVEL).mean()) < CHANGED_SHARE


def _colours_at(task: Task, lens: int, corners: NDArray[np.int64]) -> NDArray[np.float32]:
    means = native.patch_means(task.scene.frame.images[lens], corners, PATCH_PX)
    return means.reshape(-1, 3)


def follow(task: Task, unchanged: bool) -> Track:
    """The object's track after this frame.

    Args:
        task: the object and the frame.
        unchanged: result of `first_look`.
    """
    track, now = task.track, task.scene.frame.t_ns
    if unchanged and not task.is_turn and not is_under_review(track):
        return replace(track, motion=Motion.rest(now), seen_ns=now)
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
    evidence, belief = window.evidence, believed(task, window.observation, fit)
    if task.is_first:
        first = at_first(task, evidence, belief)
        if first is None:
            return _lost(task, belief)
        belief = first
        if not _is_elsewhere(track, belief.fit):
            correlation = max(belief.fit.colour_correlation, 0.0)
            track = replace(track, initial_correlation=correlation)
            task = replace(task, track=track)
    if belief.is_unseen:
        return _miss(task, belief)
    if task.is_first:
        rests = not _has_moved(task, belief.fit, unchanged=unchanged)
        return _accept(task, evidence, belief, rests=rests, unchanged=unchanged)
    rested = track.state is TrackState.STATIC and track.missed_frames == 0
    if rested and is_on_a_passer_by(track, belief):
        return _at_rest(task, evidence, belief, unchanged=unchanged)
    is_doubtful = unchanged or not _has_moved(task, belief.fit, unchanged=unchanged)
    if rested and is_at_rest_still(task, belief, is_doubtful=is_doubtful):
        return _at_rest(task, evidence, belief, unchanged=unchanged)
    if not rested:
        back = _back(task, least=max(belief.found.nats, 0.0))
        if back is not track:
            return back
    belief = _again(task, evidence, belief)
    task, fit = reviewed(task, evidence, belief)
    if fit is not belief.fit:
        task = _corrected(task, belief.fit, fit)
        belief = believed(task, belief.observation, fit)
    if is_followed(task.track, belief):
        return _accept(task, evidence, belief, rests=False, unchanged=unchanged)
    return _miss(task, belief)


def _shows_at(task: Task, world_from_object: Pose, *, least: float = 0.0) -> bool:
    """Whether an object clearly shows at a pose, by more nats than the least."""
    scene, model = task.scene, task.model
    evidence = gather(scene, model, view_of(scene, model, world_from_object), task.neighbours)
    observation = observe(scene, evidence)
    support = pose_support(observation, model, world_from_object, scene.renderer)
    return support.nats > least + CLEAR_NATS and not support.is_covered


def _back(task: Task, *, least: float = 0.0) -> Track:
    """The track at the place where the object stood before, if it clearly shows there again.

    What was dragged along with a passer-by, or lost, may be where it last was in plain sight.
    """
    track, now = task.track, task.scene.frame.t_ns
    stood = track.world_from_stood
    if stood is None or not is_other(task.model, stood, track.world_from_object):
        return track
    if not _shows_at(task, stood, least=least):
        return track
    back = replace(
        track,
        world_from_object=stood,
        motion=Motion.rest(now),
        state=TrackState.OCCLUDED,
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
    if is_shaken(task.track, belief) and not unchanged:
        task, fit = reviewed(task, evidence, belief, is_shaken=True)
        if fit is not belief.fit:
            turned = believed(task, belief.observation, fit)
            if accounts_for_change(task, turned):
                return _accept(task, evidence, turned, rests=False, unchanged=False)
    if belief.before.nats < CLEAR_NATS and not unchanged:
        return _miss(task, belief)
    if _has_moved(task, belief.fit, unchanged=unchanged):
        belief = at_pose(task, evidence, belief, task.track.world_from_object)
    return _accept(task, evidence, belief, rests=True, unchanged=unchanged)


def _has_moved(task: Task, fit: Fit, *, unchanged: bool) -> bool:
    """Whether a resting object was measured farther off than its measurements scatter."""
    step = pose_vector(fit.world_from_object) - pose_vector(task.track.world_from_object)
    step[3] = 0.0 if task.model.symmetry == ROUND else wrap_angle(float(step[3]))
    sigma = np.sqrt(np.diag(fit.covariance))
    far = max(MOVED_M, SIGNIFICANT * float(np.linalg.norm(sigma[:2])))
    turned = max(MOVED_RAD, SIGNIFICANT * float(sigma[3]))
    stays = float(np.linalg.norm(step[:3])) < far and abs(float(step[3])) < turned
    return not stays or not (unchanged or not _was_taken_up(task, fit))


def _accept(
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
    step = pose_vector(fit.world_from_object) - pose_vector(track.world_from_object)
    step[3] = wrap_angle(float(step[3]))
    if task.model.symmetry == ROUND:
        step[3] = 0.0
    distance, turn = float(np.linalg.norm(step[:3])), abs(float(step[3]))
    seen = replace(
        track,
        covariance=uncertainty(task.scene, task.model, fit),
        visible_fraction=fit.visible_fraction,
        confidence=confidence_of(belief.found, track.rival_nats),
        usual_inlier_ratio=_usual(track.usual_inlier_ratio, fit.unoccluded_inlier_ratio),
        usual_correlation=_usual(track.usual_correlation, fit.colour_correlation),
        missed_frames=0,
        seen_ns=now,
        reduced=fit.reduced,
    )
    if rests and not belief.found.is_covered and belief.found.nats > CLEAR_NATS:
        seen = replace(seen, world_from_stood=track.world_from_object)
    kept = 1.0 if rests else KEPT_SHARE
    seen = replace(seen, usual_nats=max(kept * track.usual_nats, belief.found.nats))
    if track.state is TrackState.STATIC and rests:
        blend = REST_BLEND if fit.visible_fraction > 0.85 and track.rest is not None else 0.0
        world_from_object = vector_pose(pose_vector(track.world_from_object) + blend * step)
        # What begins to leave is not where it was: it would be portrayed wrongly.
        is_quiet = unchanged or track.appearance is None
        is_remembered = track.appearance is not None and track.appearance.is_valid_at(
            world_from_object
        )
        known = replace(fit, world_from_object=world_from_object)
        return replace(
            seen,
            world_from_object=world_from_object,
            motion=Motion.rest(now),
            rest=rest_of(task, fit),
            appearance=_appearance(task, evidence, known)
            if is_quiet and not is_remembered
            else track.appearance,
        )
    still = distance < RESTING_STEP_M and turn < RESTING_STEP_RAD
    still_frames = track.still_frames + 1 if still else 0
    if still_frames >= RESTING_FRAMES:
        fit = _settled(task, evidence, belief)
        return replace(
            seen,
            world_from_object=fit.world_from_object,
            world_from_stood=fit.world_from_object,
            motion=Motion.rest(now),
            state=TrackState.STATIC,
            still_frames=still_frames,
            rest=rest_of(task, fit),
            appearance=_appearance(task, evidence, fit),
        )
    motion = track.motion.measured(track.world_from_object, fit.world_from_object, now)
    if task.is_first or track.missed_frames > 3:
        motion = Motion.rest(now)
    return replace(
        seen,
        world_from_object=fit.world_from_object,
        motion=motion,
        state=TrackState.TRACKED,
        still_frames=still_frames,
        rest=None,
        appearance=_appearance_in_motion(task, evidence, fit),
    )


def _is_elsewhere(track: Track, fit: Fit) -> bool:
    """Whether an object was found clearly beside its place: what moved it may have turned it."""
    apart = pose_vector(fit.world_from_object) - pose_vector(track.world_from_object)
    return float(np.linalg.norm(apart[:3])) > ELSEWHERE_M


def _was_taken_up(task: Task, fit: Fit) -> bool:
    """Whether a standing object is now lifted; from afar its distance is too uncertain."""
    stood = not is_lifted(task, task.track.world_from_object)
    return stood and is_lifted(task, fit.world_from_object)


def _usual(before: float, now: float) -> float:
    """Running value that follows increases at once and decreases slowly."""
    return max(now, (1.0 - FORGOTTEN) * before + FORGOTTEN * now)


def _again(task: Task, evidence: Evidence, belief: Belief) -> Belief:
    """The belief, refined anew where its pose shows clearly less than the object did before.

    What was hidden already and still does not show is looked for around its prediction, a part in
    each frame: refined in all of them it takes 50 ms a frame, and goes, where it goes, to poses
    that show as little, up to 47 cm away.
    """
    track, nats = task.track, belief.found.nats
    is_hidden = track.missed_frames > 0 and nats <= CLEAR_NATS
    open_share = 1.0 - belief.found.unknown_fraction
    if is_hidden or nats > open_share * track.usual_nats - CLEAR_NATS:
        return belief
    settled = _settled(task, evidence, belief)
    return belief if settled is belief.fit else believed(task, belief.observation, settled)


def _settled(task: Task, evidence: Evidence, belief: Belief) -> Fit:
    """The fit of an object that comes to rest, or a likelier one that it refines to."""
    start, observation = belief.fit.world_from_object, belief.observation
    x, y, z, yaw = START_SIGMA
    is_carried = task.model.source.box_m[2] < HEAVY_HEIGHT_M and is_lifted(task, start)
    sigma = (x, y, CARRIED_SIGMA_M if is_carried else z, yaw)
    again = refined(task.scene, task.model, start, evidence, observation, sigma=sigma)
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


def _miss(task: Task, belief: Belief) -> Track:
    """The track after a frame without an accepted measurement: held where it was, or lost."""
    track, now = task.track, task.scene.frame.t_ns
    missed = track.missed_frames + 1
    is_carried = task.model.source.box_m[2] < HEAVY_HEIGHT_M
    grown = track.covariance + np.diag([0.03**2, 0.03**2, 0.002**2, math.radians(3) ** 2])
    held = replace(
        track,
        covariance=grown,
        visible_fraction=belief.before.open_fraction * belief.before.matched_fraction,
        confidence=confidence_of(belief.before, track.rival_nats),
        missed_frames=missed,
        still_frames=0,
        state=TrackState.OCCLUDED,
        motion=track.motion if is_carried and missed <= COASTED_FRAMES else Motion.rest(now),
        rest=None,
    )
    return _lost(replace(task, track=held), belief) if belief.has_left and missed >= 2 else held


def _lost(task: Task, belief: Belief) -> Track:
    """The track of an object that has to be searched for."""
    review = task.track.review
    return replace(
        task.track,
        review=None if review is None else replace(review, pending=None),
        state=TrackState.LOST,
        confidence=confidence_of(belief.before, task.track.rival_nats),
        visible_fraction=belief.before.open_fraction * belief.before.matched_fraction,
        missed_frames=task.track.missed_frames + 1,
        still_frames=0,
        motion=Motion.rest(task.scene.frame.t_ns),
        rest=None,
        looked_ns=task.track.seen_ns,
        searched_ns=task.scene.frame.t_ns - SEARCH_PERIOD_NS,
        searches_in_vain=0,
    )


def rest_of(task: Task, fit: Fit) -> Rest:
    """Patch colours on and around an object at rest, including those of its occluders."""
    reduced, view = fit.reduced, view_of(task.scene, task.model, fit.world_from_object)
    camera_from_object = view.world_from_camera.inverse() @ fit.world_from_object
    inside, _ = view.camera.project(camera_from_object @ reduced.surface)
    border, _ = view.camera.project(camera_from_object @ reduced.contour.points)
    around = (border + BESIDE_PX * reduced.contour.normals)[::BESIDE_STEP]
    pixels = view.lens_pixels(np.concatenate([inside, around]))
    lens = task.scene.frame.rig.lenses[view.lens]
    limit = np.array([lens.width_px, lens.height_px]) - PATCH_PX
    corners = np.clip(np.floor(pixels - 0.5 * PATCH_PX), 0, limit).astype(np.int64)
    return Rest(view.lens, corners, _colours_at(task, view.lens, corners), len(inside))
