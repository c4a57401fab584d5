"""Standing or carried: which of two poses found under different beliefs is the likelier.

A thing that slides away along a table looks like one that is lifted. A scan with faults often fits
a little better in the air; so what its neighbouring points say alike counts once, its pattern has a
say, and what keeps still is hardly in a hand.
"""

from __future__ import annotations

import math

from scenes.pose import Pose, wrap_angle
from tracking.follow.track import RESTING_FRAMES, Task
from tracking.kernels.options import OPTIONS
from tracking.solve.gauss_newton import Fit, Prior
from tracking.solve.motion import pose_vector

LIFTED_M, NEAR_M = 0.015, 0.15
"""A thing hangs in the air if it is more than the first above a support, and within the second."""

STILL_DEVIANCE = 2.0 * math.log(10.0)
"""A hand keeps a thing as still as if it stood in one frame of ten: -2 log of that, per frame."""

PATTERN_CORRELATION = 9.0
"""So many neighbouring points of a surface count as one: they share blur and light."""

BARE_DEVIANCE = 2.0 * math.log(10.0)
"""A place of a thing shows the empty room in one case of ten: -2 log of that."""

MOST_CORRELATED = 0.99


def is_likelier(task: Task, other: tuple[Fit, Prior], best: tuple[Fit, Prior]) -> bool:
    """Whether the first of two fits, each with the belief behind it, is the likelier.

    One belief has the object stand on something, the other, wider in height, has it carried.
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
    # The model's own errors scale the misfit of every pose alike: what counts is the ratio. Where
    # neighbours err alike they say less, and what they push off its height is not as far off.
    lift = float(found[2] - prior.mean[2]) / prior.sigma[2]
    weight = len(fit.reduced.contour) / OPTIONS.contour_correlation
    outline = (weight * math.log(max(fit.contour_chi2, 1.0)) + lift**2) / variance_inflation
    surface = _pattern_deviance(fit) + _bare_deviance(fit)
    return outline + surface + float(apart @ apart) + 2 * math.log(prior.sigma[2])


def _pattern_deviance(fit: Fit) -> float:
    """-2 log likelihood of a textured object's colours, whatever the light's gain and noise."""
    if not fit.textured:
        return 0.0
    count = fit.visible_fraction * len(fit.reduced.surface) / PATTERN_CORRELATION
    return count * math.log(1.0 - min(max(fit.colour_correlation, 0.0), MOST_CORRELATED) ** 2)


def _bare_deviance(fit: Fit) -> float:
    """-2 log likelihood of the places that should show a thing and show the empty room."""
    bare = max(1.0 - fit.visible_fraction - fit.covered_fraction, 0.0)
    return BARE_DEVIANCE * bare * len(fit.reduced.surface) / PATTERN_CORRELATION


def is_lifted(task: Task, world_from_object: Pose) -> bool:
    """Whether an object hangs clearly above every support it is near to: things do not sink in."""
    height = float(world_from_object.translation[2])
    return all(height - z > LIFTED_M or z - height > NEAR_M for z in task.support_heights_m)
