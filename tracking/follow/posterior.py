"""Priors of an object's pose before a frame, and acceptance of its measurement."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.follow.track import Task, Track
from tracking.solve.gauss_newton import Fit, Prior
from tracking.solve.motion import pose_vector

ACCEPTED_CONTOUR_SCORE = 0.42
"""Contour score from which a fit is accepted. Chosen on the rooms lab and desk."""


CONCLUSIVE_INLIER_RATIO = 0.55
"""Inlier ratio of the unoccluded contour from which no other pose is tried. Chosen on the rooms lab
and desk."""

USUAL_SHARE = 0.85
"""Share of an object's usual ratio and correlation that a conclusive fit must reach. Chosen on the
rooms lab and desk."""


CONCLUSIVE_CORRELATION = 0.38
"""Colour correlation of a textured object from which no other pose is tried. Chosen on the rooms
lab and desk."""

ACCEPTED_CORRELATION = 0.35
"""Colour correlation of a textured object from which a fit is accepted. Chosen on the rooms lab and
desk."""


RECOGNISED_CORRELATION = 0.5
"""Colour correlation from which a pattern is recognised. Chosen on the rooms lab and desk."""

RECOGNISED_VISIBLE = 0.6
"""Visible fraction that recognition needs. Chosen on the rooms lab and desk."""

RECOGNISED_CONTOUR_SCORE = 0.3
"""Contour score from which a fit with a recognised pattern is accepted. Chosen on the rooms lab and
desk."""


MIN_VISIBLE = 0.15
"""Visible fraction below which no fit is accepted. Chosen on the rooms lab and desk."""


HEAVY_HEIGHT_M = 0.3
"""Height in m from which an object is taken to stay on its support from one picture to the next,
until it is seen in the air; lower ones may be taken up at any time."""

LIFTED_CLEARLY_M = 0.08
"""Height in m above its support from which what is tall is in the air: a third of a second's lift,
and more than a scan's support is off."""

WIDEST_CARRIED_M = 1.2
"""Longest side in m of what people carry."""


CARRIED_SIGMA_M = 0.08
"""Standard deviation in m of a carried object's height about its prediction. Chosen on the rooms
lab and desk."""


CONTACT_SIGMA_M = 0.003
"""Standard deviation in m of a support plane's height in a scan. Chosen on the rooms lab and
desk."""


SNAP_M = 0.03
"""Distance in m to a support plane within which standing is the first hypothesis. Chosen on the
rooms lab and desk."""

REACHABLE_M = 0.15
"""Distance in m to a support plane within which standing is a hypothesis. Chosen on the rooms lab
and desk."""


REST_RADIUS_M = 0.01
"""Displacement in m from which a resting object may be carried. Chosen on the rooms lab and
desk."""


RESTING_SIGMA_M = 0.012
"""Standard deviation in m of a resting object's position about its prediction. Chosen on the rooms
lab and desk."""

RESTING_SIGMA_RAD = math.radians(1.5)
"""The same of its yaw, in rad. Chosen on the rooms lab and desk."""

MOVING_SIGMA_M = 0.10
"""Standard deviation in m of a moving object's position about its prediction. Chosen on the rooms
lab and desk."""

MOVING_SIGMA_RAD = math.radians(14)
"""The same of its yaw, in rad. Chosen on the rooms lab and desk."""


def priors(task: Task, predicted_world_from_object: Pose) -> list[Prior]:
    """Priors of an object's pose, the likeliest first: standing on a support plane, or carried.

    Args:
        task: the object.
        predicted_world_from_object: mean of the priors.
    """
    track, source = task.track, task.model.source
    mean, sigma = pose_vector(predicted_world_from_object), _spread(track)
    known = (track.silhouette_bias_m, track.silhouette_bias_sigma_m)
    if is_heavy(task, predicted_world_from_object):
        return [_standing(mean, source.support_z_m, sigma, known)]
    free = carried_prior(task, predicted_world_from_object)
    heights = np.array(task.support_heights_m)
    nearest = float(heights[np.argmin(np.abs(heights - mean[2]))])
    if abs(nearest - mean[2]) > REACHABLE_M:
        return [free]
    standing = _standing(mean, nearest, sigma, known)
    return [standing, free] if abs(nearest - mean[2]) < SNAP_M else [free, standing]


def carried_prior(task: Task, predicted_world_from_object: Pose) -> Prior:
    """Prior of the pose of an object that is in the air."""
    track = task.track
    sigma = _spread(track) + np.array([0.0, 0.0, CARRIED_SIGMA_M, 0.0])
    sigma = np.maximum(sigma, [0.05, 0.05, 0.0, math.radians(8)])
    mean = pose_vector(predicted_world_from_object)
    return Prior(mean, sigma, track.silhouette_bias_m, track.silhouette_bias_sigma_m)


def _spread(track: Track) -> NDArray[np.float64]:
    """(4,) standard deviations of x, y, z and yaw about a prediction, of what stands."""
    if track.state is TrackState.STATIC and track.missed_frames == 0:
        return np.array([RESTING_SIGMA_M, RESTING_SIGMA_M, 0.0, RESTING_SIGMA_RAD])
    spread = 1.0 + 0.5 * min(track.missed_frames, 8)
    return np.array([MOVING_SIGMA_M, MOVING_SIGMA_M, 0.0, MOVING_SIGMA_RAD]) * spread


def is_carriable(box_m: Sequence[float]) -> bool:
    """Whether people may carry an object with a box of these sides, m."""
    return max(box_m) <= WIDEST_CARRIED_M


def is_heavy(task: Task, world_from_object: Pose) -> bool:
    """Whether an object at a pose is taken to stay on its support: tall, and not in the air."""
    source = task.model.source
    if source.box_m[2] < HEAVY_HEIGHT_M:
        return False
    return abs(float(world_from_object.translation[2]) - source.support_z_m) < LIFTED_CLEARLY_M


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


def is_conclusive(task: Task, fit: Fit) -> bool:
    """Whether a fit is so good that no other position or yaw needs to be tried."""
    wanted = max(CONCLUSIVE_CORRELATION, USUAL_SHARE * task.track.usual_correlation)
    correlates = not fit.textured or fit.colour_correlation >= wanted
    usual = fit.unoccluded_inlier_ratio >= USUAL_SHARE * task.track.usual_inlier_ratio
    return (
        fit.contour_score >= ACCEPTED_CONTOUR_SCORE
        and fit.unoccluded_inlier_ratio >= CONCLUSIVE_INLIER_RATIO
        and usual
        and correlates
    )


def min_correlation(track: Track) -> float:
    """Colour correlation that a textured object's fit must reach.

    A blurred scan or a distant object reaches less even at the right pose.
    """
    return min(ACCEPTED_CORRELATION, USUAL_SHARE * track.initial_correlation)


def is_accepted(fit: Fit, *, wanted_correlation: float = ACCEPTED_CORRELATION) -> bool:
    """Whether enough of the object is visible, its edges agree and its colours correlate."""
    correlates = not fit.textured or fit.colour_correlation >= wanted_correlation
    least = RECOGNISED_CONTOUR_SCORE if shows_pattern(fit) else ACCEPTED_CONTOUR_SCORE
    return fit.contour_score >= least and fit.visible_fraction >= MIN_VISIBLE and correlates


def shows_pattern(fit: Fit) -> bool:
    """Whether a textured object is recognised by its pattern alone."""
    shows = fit.visible_fraction >= RECOGNISED_VISIBLE
    return fit.textured and shows and fit.colour_correlation >= RECOGNISED_CORRELATION
