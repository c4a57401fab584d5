"""One object from frame to frame: rest, motion, occlusion, loss and recovery."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose, wrap_angle
from scenes.state import TrackedObject, TrackState
from scenes.warp import VirtualView, warp
from tracking.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.metrics import ROUND
from tracking.model import TrackModel
from tracking.recover import find, overview
from tracking.smooth import Motion, pose_vector, vector_pose
from tracking.solve import (
    COLD_REACHES,
    HALO_M,
    HALO_SIGMA_M,
    SLID_REACHES,
    TRACKING_REACHES,
    Fit,
    Prior,
    solve,
)

FloatArray = NDArray[np.float32]

HOLD_BELOW = 0.42
"""The pose is held while fewer contour points than this share agree."""

CONVINCING = 0.55
"""Below this share, other places and yaws are tried as well."""

CONVINCING_LIKENESS = 0.38
LEAST_LIKENESS = 0.35
"""What the likeness of a textured object must reach to convince, and to be believed at all."""

FAR_PRICE = 0.012
"""Quality that a pose costs per squared standard deviation from its prediction."""

LEAST_VISIBLE = 0.15
"""Below this visible fraction nothing is measured."""

GONE_BELOW = 0.25
"""A silhouette that shows less of the object than this, and nothing in front, shows it is gone."""

CHANGED_LEVEL = 0.055
CHANGED_SHARE = 0.02
"""A crop has changed if colours differ by the level in this share of the silhouette."""

MOVED_M = 0.010
MOVED_RAD = math.radians(2.0)
"""A resting object has moved when a solve puts it farther away than this."""

SIGNIFICANT = 2.5
"""A resting object has moved only if it did so by this many standard deviations of the solve."""

RESTING_STEP_M = 0.005
RESTING_STEP_RAD = math.radians(0.7)
RESTING_FRAMES = 6
"""An object rests after this many frames with smaller steps."""

REST_BLEND = 0.2
"""Share of a new measurement in a resting object's pose."""

HEAVY_HEIGHT_M = 0.3
"""Objects at least this tall stay on the floor; smaller ones may be carried."""

CONTACT_SIGMA_M = 0.003
CARRIED_SIGMA_M = 0.08
SNAP_M = 0.03
REACHABLE_M = 0.15
LIFTED_M = 0.015
"""A small object nearer than the first to a support is first taken to stand on it, nearer than the
second perhaps."""

RESTING_SIGMA_M = 0.012
RESTING_SIGMA_RAD = math.radians(1.5)
MOVING_SIGMA_M = 0.10
MOVING_SIGMA_RAD = math.radians(14)
"""How far an object may be from its prediction, as standard deviations."""

SEARCH_PERIOD_NS = 800_000_000
"""A lost object is searched for at most this often."""

LOST_AFTER = 12
"""Frames without agreement, with the place in view, after which an object counts as lost."""

FLOOR_COVARIANCE = np.diag([0.004**2, 0.004**2, 0.003**2, math.radians(0.4) ** 2])
"""What no single solve can be better than: camera pose, model scale and halo (systematic)."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """How a resting object looks, to see cheaply whether anything changed.

    Attributes:
        view: the crop it is looked at through.
        picture: (H, W, 3) float32 the crop when its pose was last confirmed.
        silhouette: (H, W) bool, a little widened.
    """

    view: VirtualView
    picture: FloatArray
    silhouette: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What is remembered of one object.

    Attributes:
        world_from_object: `world_from_object`, latest.
        motion: its velocity.
        state: see `TrackState`.
        covariance: (4, 4) of x, y, z, yaw.
        visible_fraction: 0..1.
        confidence: 0..1.
        halo_m: learned distance of the drawn surface outside the real one.
        halo_sigma_m: how well that is known.
        still_frames: frames in a row with hardly a step.
        missed_frames: frames in a row without agreement.
        rest: how it looks at rest; None while it isn't known to rest.
        searched_ns: frame time of the last search over the whole scene.
    """

    world_from_object: Pose
    motion: Motion
    state: TrackState
    covariance: NDArray[np.float64]
    visible_fraction: float
    confidence: float
    halo_m: float
    halo_sigma_m: float
    still_frames: int
    missed_frames: int
    rest: Rest | None
    searched_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One object in one frame.

    Attributes:
        scene: the frame.
        model: the object.
        track: what is remembered of it.
        neighbours: the other objects.
        supports_m: heights of planes things stand on.
        is_turn: whether this resting object is measured anew in this frame.
        is_first: whether this is the first frame of the session.
        may_search: whether a search over the whole scene is allowed in this frame.
        use_texture: whether inner colours take part.
    """

    scene: Scene
    model: TrackModel
    track: Track
    neighbours: tuple[Neighbour, ...]
    supports_m: tuple[float, ...]
    is_turn: bool
    is_first: bool
    may_search: bool
    use_texture: bool


def new_track(model: TrackModel) -> Track:
    """An object where the scene says, not yet seen."""
    return Track(
        world_from_object=model.source.world_from_object,
        motion=Motion.rest(0),
        state=TrackState.STATIC,
        covariance=np.diag([0.02**2, 0.02**2, 0.01**2, math.radians(2) ** 2]),
        visible_fraction=0.0,
        confidence=0.0,
        halo_m=HALO_M,
        halo_sigma_m=HALO_SIGMA_M,
        still_frames=RESTING_FRAMES,
        missed_frames=0,
        rest=None,
        searched_ns=-SEARCH_PERIOD_NS,
    )


def first_look(task: Task) -> bool:
    """Whether a resting object's crop is unchanged, so that nothing needs to be solved."""
    rest, track = task.track.rest, task.track
    if rest is None or track.state is not TrackState.STATIC:
        return False
    live = warp(task.scene.frame.images[rest.view.lens], rest.view.table)
    live = np.asarray(live, dtype=np.float32) * np.float32(1 / 255.0)
    apart = cv2.GaussianBlur(live - rest.picture, (5, 5), 1.2)
    # Exposure drifts alike everywhere; what has changed is what differs from that.
    apart = np.abs(apart - np.median(apart[::4, ::4].reshape(-1, 3), axis=0))
    changed = apart.max(axis=2)[rest.silhouette] > CHANGED_LEVEL
    return bool(changed.mean() < CHANGED_SHARE) if changed.size else False


def follow(task: Task, unchanged: bool) -> Track:
    """The object's track after this frame.

    Args:
        task: the object and the frame.
        unchanged: result of `first_look`.
    """
    track, now = task.track, task.scene.frame.t_ns
    if unchanged and not task.is_turn:
        return replace(track, motion=Motion.rest(now))
    if track.state is TrackState.LOST:
        return _search(task)
    predicted_world_from_object = track.motion.predict(track.world_from_object, now)
    evidence = gather(
        task.scene,
        task.model,
        view_of(task.scene, task.model, predicted_world_from_object),
        task.neighbours,
    )
    fit = _measure(task, evidence, predicted_world_from_object)
    if _believable(fit) and not _is_doubtful(task, fit):
        return _accept(task, evidence, fit)
    if task.is_first and fit.covered_fraction < 0.5:
        return _search(task)
    return _miss(task, fit)


def report(model: TrackModel, track: Track, frame: Frame) -> TrackedObject:
    """What the rest of the studio is told."""
    return TrackedObject(
        object_id=model.object_id,
        t_ns=frame.t_ns,
        world_from_object=track.world_from_object,
        covariance=track.covariance,
        visible_fraction=track.visible_fraction,
        state=track.state,
        confidence=track.confidence,
        source_seq=frame.seq,
    )


def priors(task: Task, predicted_world_from_object: Pose) -> list[Prior]:
    """What may be known before looking, the likeliest first: standing on something, or carried.

    Args:
        task: the object.
        predicted_world_from_object: where it is expected.
    """
    track, source = task.track, task.model.source
    mean = pose_vector(predicted_world_from_object)
    if track.state is TrackState.STATIC and track.missed_frames == 0:
        sigma = np.array([RESTING_SIGMA_M, RESTING_SIGMA_M, 0.0, RESTING_SIGMA_RAD])
    else:
        spread = 1.0 + 0.5 * min(track.missed_frames, 8)
        sigma = np.array([MOVING_SIGMA_M, MOVING_SIGMA_M, 0.0, MOVING_SIGMA_RAD]) * spread
    known = (track.halo_m, track.halo_sigma_m)
    if source.box_m[2] >= HEAVY_HEIGHT_M:
        return [_standing(mean, source.support_z_m, sigma, known)]
    carried = sigma + np.array([0.0, 0.0, CARRIED_SIGMA_M, 0.0])
    free = Prior(mean, np.maximum(carried, [0.05, 0.05, 0.0, math.radians(8)]), *known)
    heights = np.array(task.supports_m)
    nearest = float(heights[np.argmin(np.abs(heights - mean[2]))])
    if abs(nearest - mean[2]) > REACHABLE_M:
        return [free]
    standing = _standing(mean, nearest, sigma, known)
    return [standing, free] if abs(nearest - mean[2]) < SNAP_M else [free, standing]


def _standing(
    mean: NDArray[np.float64],
    height_m: float,
    sigma: NDArray[np.float64],
    known: tuple[float, float],
) -> Prior:
    mean, sigma = mean.copy(), sigma.copy()
    mean[2], sigma[2] = height_m, CONTACT_SIGMA_M
    return Prior(mean, sigma, *known)


def _measure(task: Task, evidence: Evidence, predicted_world_from_object: Pose) -> Fit:
    """Solve from the prediction, and from farther off if that does not convince."""
    beliefs = priors(task, predicted_world_from_object)
    quick = TRACKING_REACHES if task.track.missed_frames == 0 else COLD_REACHES
    best = _try(task, evidence, predicted_world_from_object, beliefs[0], reaches_px=quick)
    if _convincing(best) or best.covered_fraction > 0.5:
        return best
    # Not where it was expected: slide it there first, then try other yaws too.
    turns = (0.0,) if task.model.symmetry == ROUND or _believable(best) else (0.0, 0.35, -0.35)
    for belief in beliefs:
        free = belief.sigma[2] > CONTACT_SIGMA_M
        wide = replace(belief, sigma=belief.sigma * np.array([2.0, 2.0, 1.0, 2.0]))
        for turn in turns:
            start = vector_pose(
                pose_vector(predicted_world_from_object) + np.array([0.0, 0.0, 0.0, turn])
            )
            reaches = SLID_REACHES if task.model.textured else COLD_REACHES
            other = _try(task, evidence, start, wide, reaches_px=reaches, slide=True)
            if free and not _is_lifted(task, other.world_from_object):
                continue
            margin = 0.06 if _believable(best) else 0.02
            if _worth(other, belief) > _worth(best, beliefs[0]) + margin:
                best = other
    return best


def _is_doubtful(task: Task, fit: Fit) -> bool:
    """Whether a believable fit is still too weak for where it is: in the air, or after a gap."""
    if not task.scene.holds(fit.world_from_object):
        return True
    small = task.model.source.box_m[2] < HEAVY_HEIGHT_M
    if not (small and task.model.textured):
        return False
    unsure = task.track.missed_frames > 0
    lifted = _is_lifted(task, fit.world_from_object)
    wanted = LEAST_LIKENESS + 0.05 * lifted + 0.12 * unsure
    return fit.likeness < wanted or (unsure and fit.agreement < CONVINCING)


def _is_lifted(task: Task, world_from_object: Pose) -> bool:
    """Whether an object hangs clearly above every support it is near to: things do not sink in."""
    height = float(world_from_object.translation[2])
    return all(height - z > LIFTED_M or z - height > REACHABLE_M for z in task.supports_m)


def _worth(fit: Fit, belief: Prior) -> float:
    """Quality less the price of being far from what was expected."""
    apart = pose_vector(fit.world_from_object) - belief.mean
    apart[3] = wrap_angle(float(apart[3]))
    return fit.quality - FAR_PRICE * min(float(((apart / belief.sigma) ** 2).sum()), 9.0)


def _try(
    task: Task,
    evidence: Evidence,
    start: Pose,
    prior: Prior,
    *,
    reaches_px: tuple[float, ...],
    slide: bool = False,
) -> Fit:
    """One solve; the start is put on the height that the prior is sure of."""
    vector = pose_vector(start)
    if prior.sigma[2] <= CONTACT_SIGMA_M:
        vector[2] = prior.mean[2]
    return solve(
        evidence,
        task.model,
        vector_pose(vector),
        prior,
        task.scene.renderer,
        reaches_px=reaches_px,
        use_texture=task.use_texture,
        slide_first=slide,
    )


def _convincing(fit: Fit) -> bool:
    alike = not fit.textured or fit.likeness >= CONVINCING_LIKENESS
    return fit.agreement >= CONVINCING and alike


def _believable(fit: Fit) -> bool:
    alike = not fit.textured or fit.likeness >= LEAST_LIKENESS
    return fit.agreement >= HOLD_BELOW and fit.visible_fraction >= LEAST_VISIBLE and alike


def _accept(task: Task, evidence: Evidence, fit: Fit) -> Track:
    """The track after a convincing measurement."""
    track, now = task.track, task.scene.frame.t_ns
    step = pose_vector(fit.world_from_object) - pose_vector(track.world_from_object)
    step[3] = wrap_angle(float(step[3]))
    if task.model.symmetry == ROUND:
        step[3] = 0.0
    distance, turn = float(np.linalg.norm(step[:3])), abs(float(step[3]))
    seen = replace(
        track,
        covariance=fit.covariance + FLOOR_COVARIANCE,
        visible_fraction=fit.visible_fraction,
        confidence=min(1.0, fit.agreement / 0.9),
        missed_frames=0,
    )
    sigma = np.sqrt(np.diag(fit.covariance))
    far = max(MOVED_M, SIGNIFICANT * float(np.linalg.norm(sigma[:2])))
    turned = max(MOVED_RAD, SIGNIFICANT * float(sigma[3]))
    if track.state is TrackState.STATIC and distance < far and turn < turned:
        blend = REST_BLEND if fit.visible_fraction > 0.85 and track.rest is not None else 0.0
        world_from_object = vector_pose(pose_vector(track.world_from_object) + blend * step)
        return replace(
            seen,
            world_from_object=world_from_object,
            motion=Motion.rest(now),
            rest=_rest(task, evidence, fit),
        )
    still = distance < RESTING_STEP_M and turn < RESTING_STEP_RAD
    still_frames = track.still_frames + 1 if still else 0
    if still_frames >= RESTING_FRAMES:
        return replace(
            seen,
            world_from_object=fit.world_from_object,
            motion=Motion.rest(now),
            state=TrackState.STATIC,
            still_frames=still_frames,
            rest=_rest(task, evidence, fit),
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
    )


def _miss(task: Task, fit: Fit) -> Track:
    """The track after a frame without a measurement: hold it, or look around."""
    track, now = task.track, task.scene.frame.t_ns
    missed = track.missed_frames + 1
    grown = track.covariance + np.diag([0.03**2, 0.03**2, 0.002**2, math.radians(3) ** 2])
    held = replace(
        track,
        covariance=grown,
        visible_fraction=fit.visible_fraction,
        confidence=min(1.0, fit.agreement / 0.9) * 0.5,
        missed_frames=missed,
        still_frames=0,
        state=TrackState.OCCLUDED,
        motion=Motion.rest(now),
        rest=None,
    )
    gone = fit.visible_fraction < GONE_BELOW and fit.covered_fraction < 0.35
    if (gone and missed >= 2) or (missed >= LOST_AFTER and fit.covered_fraction < 0.35):
        return _search(replace(task, track=held))
    return held


def _search(task: Task) -> Track:
    """Look for the object over the whole scene, if it is time to."""
    track, now = task.track, task.scene.frame.t_ns
    if not task.may_search or now - track.searched_ns < SEARCH_PERIOD_NS:
        return replace(track, state=TrackState.LOST, rest=None)
    heights = task.supports_m
    if task.model.source.box_m[2] >= HEAVY_HEIGHT_M:
        heights = (task.model.source.support_z_m,)
    fit = find(
        task.scene,
        overview(task.scene),
        task.model,
        task.neighbours,
        supports_m=heights,
        last=track.world_from_object.translation,
    )
    searched = replace(track, searched_ns=now, rest=None)
    if fit is None:
        return replace(
            searched, state=TrackState.LOST, confidence=0.0, missed_frames=track.missed_frames + 1
        )
    return replace(
        searched,
        world_from_object=fit.world_from_object,
        motion=Motion.rest(now),
        state=TrackState.TRACKED,
        covariance=fit.covariance + FLOOR_COVARIANCE,
        visible_fraction=fit.visible_fraction,
        confidence=min(1.0, fit.agreement / 0.9),
        still_frames=0,
        missed_frames=0,
    )


def _rest(task: Task, evidence: Evidence, fit: Fit) -> Rest | None:
    """How the object looks now, unless something covers it."""
    if fit.covered_fraction > 0.1:
        return task.track.rest
    wide = cv2.dilate((fit.drawn.alpha > 0.5).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return Rest(evidence.view, evidence.live, wide)
