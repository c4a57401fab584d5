"""Pose hypotheses of an object, and when two of them are the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.kernels.options import OPTIONS
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import PLAIN_SHARE, Fit

Points = NDArray[np.float64]

STARTS_A_PLACE = 3
"""At most so many yaws of one place are refined: there may be better places."""

START_SIGMA = (0.25, 0.25, 0.003, 0.6)
"""How far off a pose may be before it is refined: metres and radians."""

APART = 0.3
APART_RAD = math.radians(20)
"""Poses farther apart than this, in radii of the object or in yaw, are different ones."""

OUTLINED = (0.75, 0.9)
SHOWN = (0.8, 0.95)
"""Between such support, and such shares of a silhouette that show the object, an outline begins to
be enough, and is: wrong yaws reach three quarters."""

PHOTOMETRIC_SCORE_SIGMA = 0.03
CLEAR_SIGMAS = 1.5
"""A pose must be better than another by this many standard deviations of a quality."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A pose hypothesis.

    Attributes:
        fit: the pose and its statistics.
        photometric_score: of a small object, its similarity to the picture, at most 1; None if the
            contour decides.
    """

    fit: Fit
    photometric_score: float | None

    @property
    def world_from_object(self) -> Pose:
        """Of the fit."""
        return self.fit.world_from_object

    @property
    def score(self) -> float:
        """0..1: ranks hypotheses of one object."""
        if self.photometric_score is None:
            return _outlined(self.fit)
        return max(self.photometric_score, 0.0)

    @property
    def score_sigma(self) -> float:
        """Standard deviation of the score, a ratio of correlated contour points."""
        if self.photometric_score is not None:
            return PHOTOMETRIC_SCORE_SIGMA
        count = max(len(self.fit.reduced.contour) / OPTIONS.contour_correlation, 1.0)
        share = min(max(self.score, 0.1), 0.9)
        return math.sqrt(share * (1.0 - share) / count)

    def is_clearly_better(self, other: Hypothesis) -> bool:
        """Whether this hypothesis's score is significantly higher."""
        margin = CLEAR_SIGMAS * math.hypot(self.score_sigma, other.score_sigma)
        return self.score > other.score + margin


def _outlined(fit: Fit) -> float:
    """Quality of a pose by its outline and colours.

    An outline that is better than any wrong pose's needs no colours: those of its sides depend on
    another room's light.
    """
    if fit.textured:
        return fit.score
    (ambiguous, sure), (hardly, wholly) = OUTLINED, SHOWN
    known = min(
        (fit.contour_score - ambiguous) / (sure - ambiguous),
        (fit.visible_fraction - hardly) / (wholly - hardly),
        1.0,
    )
    return max(fit.score, fit.contour_score * (1.0 - PLAIN_SHARE * (1.0 - known)))


def distinct(model: TrackModel, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best of those that say the same, the best first."""
    distinct: list[Hypothesis] = []
    for hypothesis in sorted(hypotheses, key=lambda hypothesis: -hypothesis.score):
        pose = hypothesis.world_from_object
        if all(is_other(model, pose, other.world_from_object) for other in distinct):
            distinct.append(hypothesis)
    return distinct


def is_other(model: TrackModel, world_from_a: Pose, world_from_b: Pose) -> bool:
    """Whether two poses of an object differ by more than a refinement would even out."""
    if apart(world_from_a, world_from_b) > APART * model.radius_m:
        return True
    apart_rad = np.array([world_from_a.yaw() - world_from_b.yaw()])
    return bool(are_other_turns(model, apart_rad, least=APART_RAD)[0])


def are_other_turns(model: TrackModel, apart_rad: Points, *, least: float) -> NDArray[np.bool_]:
    """(N,) whether an object looks different when turned by at least so much."""
    if model.symmetry == ROUND:
        return np.zeros(len(apart_rad), np.bool_)
    turns = (apart_rad * model.symmetry + math.pi) % (2 * math.pi) - math.pi
    turns = np.abs(turns) / model.symmetry
    return (turns > least) & np.logical_not(model.templates.are_indistinguishable(turns))


def apart(world_from_a: Pose, world_from_b: Pose) -> float:
    """Metres between two poses of an object."""
    return float(np.linalg.norm(world_from_a.translation - world_from_b.translation))
