"""What is believed of an object before a frame is measured, and which measurement to believe."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.follow.carried import is_lifted
from tracking.follow.track import Task, Track
from tracking.solve.gauss_newton import Fit, Prior
from tracking.solve.motion import pose_vector

ACCEPTED_CONTOUR_SCORE = 0.42
"""The pose is held while its outline has less support than this."""

CONCLUSIVE_INLIER_RATIO = 0.55
USUAL_SHARE = 0.85
"""Below this share, or this share of what usually agrees, other places and yaws are tried."""

CONCLUSIVE_CORRELATION = 0.38
ACCEPTED_CORRELATION = 0.35
"""What the likeness of a textured object must reach to convince, and to be believed at all."""

RECOGNISED_CORRELATION = 0.5
RECOGNISED_VISIBLE = 0.6
RECOGNISED_CONTOUR_SCORE = 0.3
"""A pattern that is seen this well, and is this like the drawn one, needs less of an outline."""

CONFIDENCE_ZERO_CONTOUR, CONFIDENCE_FULL_CONTOUR = 0.42, 0.88
CONFIDENCE_ZERO_CORRELATION, CONFIDENCE_FULL_CORRELATION = 0.2, 0.6
"""Confidence grows from 0 to 1 between these."""

PRESENT_SHARE, ABSENT_SHARE = 0.3, 0.8
"""Confidence shrinks from 1 to 0 while so much of the silhouette shows the empty room."""

SURE = 0.5
"""A pose of less confidence may be a wrong one."""

LOST_CONFIDENCE = 0.4
"""Of a pose that is only a guess, at most."""

PRESENT_CONTOUR_SCORE = 0.55
PRESENT_VISIBLE = 0.5
"""An object is where the scan says if its outline and its surface are this good, and what it shows
is believable."""

LEAST_VISIBLE = 0.15
"""Below this visible fraction nothing is measured."""

HEAVY_HEIGHT_M = 0.3
"""Objects at least this tall stay on the floor; smaller ones may be carried."""

CARRIED_SIGMA_M = 0.08
"""How far above or below its prediction something carried may be."""

FAR_PRICE = 0.012
"""Quality that a pose costs per squared standard deviation from its prediction."""

CONTACT_SIGMA_M = 0.003
"""How well a scan knows supports."""

SNAP_M = 0.03
REACHABLE_M = 0.15
"""A small object nearer than the first to a support is first taken to stand on it, nearer than the
second perhaps."""

REST_RADIUS_M = 0.01
"""A resting object that is found farther from its place may be in somebody's hands."""

RESTING_SIGMA_M = 0.012
RESTING_SIGMA_RAD = math.radians(1.5)
MOVING_SIGMA_M = 0.10
MOVING_SIGMA_RAD = math.radians(14)
"""How far an object may be from its prediction, as standard deviations."""


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
    known = (track.silhouette_bias_m, track.silhouette_bias_sigma_m)
    if source.box_m[2] >= HEAVY_HEIGHT_M:
        return [_standing(mean, source.support_z_m, sigma, known)]
    carried = sigma + np.array([0.0, 0.0, CARRIED_SIGMA_M, 0.0])
    free = Prior(mean, np.maximum(carried, [0.05, 0.05, 0.0, math.radians(8)]), *known)
    heights = np.array(task.support_heights_m)
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


def has_left_its_rest(task: Task, fit: Fit) -> bool:
    """Whether an object that rested was found elsewhere."""
    if task.track.state is not TrackState.STATIC:
        return False
    apart = fit.world_from_object.translation - task.track.world_from_object.translation
    return float(np.linalg.norm(apart)) > REST_RADIUS_M


def is_too_weak(task: Task, fit: Fit) -> bool:
    """Whether a believable fit is still too weak for where it is: in the air, or after a gap."""
    if not task.scene.contains(fit.world_from_object):
        return True
    unsure = task.track.missed_frames > 0
    weak = fit.contour_score < CONCLUSIVE_INLIER_RATIO and not shows_pattern(fit)
    if task.model.source.box_m[2] >= HEAVY_HEIGHT_M:
        return weak and unsure
    if weak and (unsure or has_left_its_rest(task, fit)):
        return True
    lifted = is_lifted(task, fit.world_from_object)
    wanted = least_correlation(task.track) + 0.05 * lifted + 0.12 * unsure
    return task.model.textured and fit.colour_correlation < wanted


def penalised_score(fit: Fit, prior: Prior) -> float:
    """Quality less the price of being far from what was expected."""
    apart = pose_vector(fit.world_from_object) - prior.mean
    apart[3] = wrap_angle(float(apart[3]))
    far = min(float(((apart / prior.sigma) ** 2).sum()), 9.0)
    return foreground_factor(fit) * fit.score - FAR_PRICE * far


def is_conclusive(task: Task, fit: Fit) -> bool:
    """Whether a fit is so good that no other place or yaw needs to be tried."""
    wanted = max(CONCLUSIVE_CORRELATION, USUAL_SHARE * task.track.usual_correlation)
    correlates = not fit.textured or fit.colour_correlation >= wanted
    usual = fit.unoccluded_inlier_ratio >= USUAL_SHARE * task.track.usual_inlier_ratio
    return (
        fit.contour_score >= ACCEPTED_CONTOUR_SCORE
        and fit.unoccluded_inlier_ratio >= CONCLUSIVE_INLIER_RATIO
        and usual
        and correlates
    )


def least_correlation(track: Track) -> float:
    """What an object's pattern has to show to be the object's.

    Where a scan is blurred or the thing is far away even the right place shows less.
    """
    return min(ACCEPTED_CORRELATION, USUAL_SHARE * track.initial_correlation)


def is_accepted(fit: Fit, *, wanted_correlation: float = ACCEPTED_CORRELATION) -> bool:
    """Whether enough of the object is seen, agrees and looks like it."""
    correlates = not fit.textured or fit.colour_correlation >= wanted_correlation
    least = RECOGNISED_CONTOUR_SCORE if shows_pattern(fit) else ACCEPTED_CONTOUR_SCORE
    return fit.contour_score >= least and fit.visible_fraction >= LEAST_VISIBLE and correlates


def shows_pattern(fit: Fit) -> bool:
    """Whether an object's pattern alone tells that it is there."""
    shows = fit.visible_fraction >= RECOGNISED_VISIBLE
    return fit.textured and shows and fit.colour_correlation >= RECOGNISED_CORRELATION


def confidence_of(fit: Fit) -> float:
    """0..1: how sure a pose is. Wrong yaws of plain objects reach agreements of two thirds."""
    sure = (fit.contour_score - CONFIDENCE_ZERO_CONTOUR) / (
        CONFIDENCE_FULL_CONTOUR - CONFIDENCE_ZERO_CONTOUR
    )
    if fit.textured:
        correlates = (fit.colour_correlation - CONFIDENCE_ZERO_CORRELATION) / (
            CONFIDENCE_FULL_CORRELATION - CONFIDENCE_ZERO_CORRELATION
        )
        sure = min(sure, correlates)
    return min(max(sure, 0.0), 1.0) * foreground_factor(fit)


def foreground_factor(fit: Fit) -> float:
    """0..1: how little of the silhouette shows the empty room."""
    missing = 1.0 - fit.visible_fraction - fit.covered_fraction
    there = (ABSENT_SHARE - missing) / (ABSENT_SHARE - PRESENT_SHARE)
    return min(max(there, 0.0), 1.0)


def is_at_scanned_pose(fit: Fit, *, is_recognised: bool | None) -> bool:
    """Whether an object that nothing is known of but the scan stands where the scan says.

    Args:
        fit: its measurement there.
        is_recognised: whether its colours explain what is seen, None if they were not asked.
    """
    if is_recognised is None:
        known = is_accepted(fit)
    else:
        known = is_recognised and is_accepted(fit, wanted_correlation=0.0)
    shown = fit.visible_fraction + fit.covered_fraction >= PRESENT_VISIBLE
    return known and shown and fit.contour_score >= PRESENT_CONTOUR_SCORE
