"""Climbs of the likelihood by clouds: some poses about each of a few, in the shape of its ridge.

Place and yaw of an object trade against each other: turned a little and shifted, it has nearly the
same outline. A climb along one coordinate after the other ends on such a ridge. A cloud takes its
shape from the best of its own poses and goes along it (the cross-entropy method, Rubinstein 1999).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose

Floats = NDArray[np.float64]

LogOdds = Callable[[Sequence[Pose]], Sequence[float]]
"""Log odds of each of some poses."""

Rounds = Sequence[tuple[int, int]]
"""Round for round, of how many clouds, the likeliest, so many poses each are compared."""

ELITE = 0.25
"""Share of a cloud, the likeliest, whose spread is the next one's: of 16 poses 4, one more than a
ridge has directions across it."""

MIN_SPREAD = 0.25
"""Spread that the next cloud has at least, as a share of this one's: a few poses in line would have
none across."""

SHRINK = 0.7
"""Of one cloud to the next: three rounds come down to a third, as a climb whose steps are halved
and that has to turn once."""


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """A pose, and poses about it.

    Attributes:
        world_from_object: the pose.
        spread: (4, 4) factor of the covariance of x, y, z and yaw: m and rad.
        log_odds: of the pose.
    """

    world_from_object: Pose
    spread: Floats
    log_odds: float = 0.0


def climb(clouds: Sequence[Cloud], log_odds: LogOdds, *, rounds: Rounds) -> list[Cloud]:
    """Clouds about the likeliest of their own poses, the likeliest first.

    Args:
        clouds: where to begin; their own log odds are found first.
        log_odds: of poses.
        rounds: at least one.
    """
    centres = log_odds([cloud.world_from_object for cloud in clouds])
    found = [replace(cloud, log_odds=odds) for cloud, odds in zip(clouds, centres, strict=True)]
    for most, count in rounds:
        found.sort(key=lambda cloud: -cloud.log_odds)
        found = _next_round(found[:most], log_odds, units=normal_points(count))
    return sorted(found, key=lambda cloud: -cloud.log_odds)


def _next_round(clouds: Sequence[Cloud], log_odds: LogOdds, *, units: Floats) -> list[Cloud]:
    tried = [_poses_in(cloud, units) for cloud in clouds]
    odds = np.array(log_odds([pose for poses in tried for pose in poses]))
    by_cloud = odds.reshape(len(clouds), len(units))
    return [
        _next(cloud, poses, odds=here, units=units)
        for cloud, poses, here in zip(clouds, tried, by_cloud, strict=True)
    ]


def _poses_in(cloud: Cloud, units: Floats) -> list[Pose]:
    pose, yaw = cloud.world_from_object, cloud.world_from_object.yaw()
    return [
        Pose.from_yaw(yaw + float(offset[3]), pose.translation + offset[:3])
        for offset in units @ cloud.spread.T
    ]


def _next(cloud: Cloud, poses: Sequence[Pose], *, odds: Floats, units: Floats) -> Cloud:
    """The cloud about the likeliest pose, spread as its elite is about that."""
    order = np.argsort(-odds, kind="stable")
    elite = units[order[: round(ELITE * len(units))]]
    best = int(order[0])
    is_higher = bool(odds[best] > cloud.log_odds)
    apart = elite - (units[best] if is_higher else 0.0)
    covariance = apart.T @ apart / len(elite) + MIN_SPREAD**2 * np.eye(4)
    spread = SHRINK * cloud.spread @ np.linalg.cholesky(covariance)
    if is_higher:
        return Cloud(poses[best], spread, float(odds[best]))
    return replace(cloud, spread=spread)


@cache
def normal_points(count: int) -> Floats:
    """(N, 4) points spread as evenly as a standard normal distribution has them.

    Quantiles of the multiples of four irrational steps, the powers of the root of x⁵ = x + 1
    (the R sequence, Roberts 2018).
    """
    root = 1.0
    for _ in range(32):
        root = (1.0 + root) ** 0.2
    steps = root ** -np.arange(1.0, 5.0)
    shares = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    return np.vectorize(NormalDist().inv_cdf)(shares)
