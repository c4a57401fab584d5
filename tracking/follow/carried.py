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

STILL_SURPRISE = 2.0 * math.log(10.0)
"""A hand keeps a thing as still as if it stood in one frame of ten: -2 log of that, per frame."""

PATTERN_CORRELATION = 9.0
"""So many neighbouring points of a surface count as one: they share blur and light."""

BARE_SURPRISE = 2.0 * math.log(10.0)
"""A place of a thing shows the empty room in one case of ten: -2 log of that."""

MOST_ALIKE = 0.99


def is_likelier(task: Task, other: tuple[Fit, Prior], best: tuple[Fit, Prior]) -> bool:
    """Whether the first of two fits, each with the belief behind it, is the likelier.

    One belief has the object stand on something, the other, wider in height, has it carried.
    """
    carried, wide = max((other, best), key=lambda found: found[1].sigma[2])
    if not is_lifted(task, carried.world_from_object):
        return carried is best[0]
    standing = best if carried is other[0] else other
    stillness = STILL_SURPRISE * min(task.track.still_frames, RESTING_FRAMES)
    alike = max(carried.alike, standing[0].alike)
    lifted = _surprise(carried, wide, wide, alike=alike) + stillness
    is_carried = bool(lifted < _surprise(*standing, wide, alike=alike))
    return is_carried == (carried is other[0])


def _surprise(fit: Fit, belief: Prior, wide: Prior, *, alike: float) -> float:
    """-2 log likelihood of a fit under a belief, up to what all beliefs share.

    Args:
        fit: the solution.
        belief: it was found with; its height counts.
        wide: the widest belief; its place and yaw count, whatever was believed.
        alike: how much less the contour says than its points would, if they erred apart.
    """
    found = pose_vector(fit.world_from_object)
    apart = (found - wide.mean) / wide.sigma
    apart[3] = wrap_angle(float(found[3] - wide.mean[3])) / wide.sigma[3]
    apart[2] = 0.0
    # The model's own errors scale the misfit of every pose alike: what counts is the ratio. Where
    # neighbours err alike they say less, and what they push off its height is not as far off.
    lift = float(found[2] - belief.mean[2]) / belief.sigma[2]
    weight = len(fit.sketch.contour) / OPTIONS.contour_correlation
    outline = (weight * math.log(max(fit.misfit, 1.0)) + lift**2) / alike
    surface = _pattern_surprise(fit) + _bare_surprise(fit)
    return outline + surface + float(apart @ apart) + 2 * math.log(belief.sigma[2])


def _pattern_surprise(fit: Fit) -> float:
    """-2 log likelihood of a textured object's colours, whatever the light's gain and noise."""
    if not fit.textured:
        return 0.0
    count = fit.visible_fraction * len(fit.sketch.surface) / PATTERN_CORRELATION
    return count * math.log(1.0 - min(max(fit.likeness, 0.0), MOST_ALIKE) ** 2)


def _bare_surprise(fit: Fit) -> float:
    """-2 log likelihood of the places that should show a thing and show the empty room."""
    bare = max(1.0 - fit.visible_fraction - fit.covered_fraction, 0.0)
    return BARE_SURPRISE * bare * len(fit.sketch.surface) / PATTERN_CORRELATION


def is_lifted(task: Task, world_from_object: Pose) -> bool:
    """Whether an object hangs clearly above every support it is near to: things do not sink in."""
    height = float(world_from_object.translation[2])
    return all(height - z > LIFTED_M or z - height > NEAR_M for z in task.supports_m)
