"""Standing or carried: model comparison of two poses found under different priors.

An object that slides away along a table looks like one that is lifted, and a scan with errors often
fits a little better in the air. Correlated residuals are therefore down-weighted, the pattern
enters the likelihood, and an object that does not move is rarely carried.
"""

from __future__ import annotations

import math

from scenes.pose import Pose, wrap_angle
from tracking.follow.track import RESTING_FRAMES, Task
from tracking.kernels.options import OPTIONS
from tracking.solve.gauss_newton import Fit, Prior
from tracking.solve.motion import pose_vector

LIFTED_M = 0.015
"""Height in m above every support plane from which an object counts as lifted. Chosen on the rooms
lab and desk."""

NEAR_M = 0.15
"""Distance in m within which a support plane is considered. Chosen on the rooms lab and desk."""


STILL_DEVIANCE = 2.0 * math.log(10.0)
"""Deviance per still frame of the carried hypothesis: a hand is that still in one frame of ten (-2
log 0.1)."""


PATTERN_CORRELATION = 9.0
"""Neighbouring surface points that count as one independent sample: they share blur and light.
Chosen on the rooms lab and desk."""


BARE_DEVIANCE = 2.0 * math.log(10.0)
"""Deviance of a surface point that shows the empty room: one in ten does at the right pose (-2 log
0.1)."""


MAX_CORRELATED = 0.99
"""Upper limit of the colour correlation, which keeps its log likelihood finite."""


def is_likelier(task: Task, other: tuple[Fit, Prior], best: tuple[Fit, Prior]) -> bool:
    """Whether the first of two (fit, prior) pairs is the likelier.

    One prior has the object standing on a support plane, the other, wider in height, has it
    carried.
    """
    carried, wide = max((other, best), key=lambda found: found[1].sigma[2])
    if not is_lifted(task, carried.world_from_object):
        return carried is best[0]
    standing = best if carried is other[0] else other
    stillness = STILL_DEVIANCE * min(task.track.still_frames, RESTING_FRAMES)
    variance_inflation = max(carried.variance_inflation, standing[0].variance_inflation)
    lifted = _deviance(carried, wide, wide, variance_inflation=variance_inflation) + stillness
    is_carried = bool(lifted < _deviance(*standing, wide, variance_inflation=variance_inflation))
    return is_carried == (carried is other[0])


def _deviance(fit: Fit, prior: Prior, wide: Prior, *, variance_inflation: float) -> float:
    """Deviance (-2 log likelihood) of a fit under a prior, up to terms common to all priors.

    Args:
        fit: the solution.
        prior: the prior of the solve; its height counts.
        wide: the widest prior; its position and yaw count, whatever prior the fit came from.
        variance_inflation: factor by which correlation of the residuals inflates their variance.
    """
    found = pose_vector(fit.world_from_object)
    apart = (found - wide.mean) / wide.sigma
    apart[3] = wrap_angle(float(found[3] - wide.mean[3])) / wide.sigma[3]
    apart[2] = 0.0
    # The model's own errors scale chi² of every pose equally: the ratio counts. Where
    # residuals are correlated they weigh less, and so does the height they imply.
    lift = float(found[2] - prior.mean[2]) / prior.sigma[2]
    weight = len(fit.reduced.contour) / OPTIONS.contour_correlation
    outline = (weight * math.log(max(fit.contour_chi2, 1.0)) + lift**2) / variance_inflation
    surface = _pattern_deviance(fit) + _bare_deviance(fit)
    return outline + surface + float(apart @ apart) + 2 * math.log(prior.sigma[2])


def _pattern_deviance(fit: Fit) -> float:
    """Deviance of a textured object's colours, gain and noise marginalised."""
    if not fit.textured:
        return 0.0
    count = fit.visible_fraction * len(fit.reduced.surface) / PATTERN_CORRELATION
    return count * math.log(1.0 - min(max(fit.colour_correlation, 0.0), MAX_CORRELATED) ** 2)


def _bare_deviance(fit: Fit) -> float:
    """Deviance of surface points that should show the object and show the empty room."""
    bare = max(1.0 - fit.visible_fraction - fit.covered_fraction, 0.0)
    return BARE_DEVIANCE * bare * len(fit.reduced.surface) / PATTERN_CORRELATION


def is_lifted(task: Task, world_from_object: Pose) -> bool:
    """Whether an object is clearly above every support plane near it; objects do not sink in."""
    height = float(world_from_object.translation[2])
    return all(height - z > LIFTED_M or z - height > NEAR_M for z in task.support_heights_m)
