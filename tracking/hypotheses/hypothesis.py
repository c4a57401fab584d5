"""Pose hypotheses of an object, and when two of them are the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.likelihood.pixel_model import PoseSupport
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import Fit

Points = NDArray[np.float64]

APART = 0.3
"""Distance from which two poses are different ones, in radii of the object: farther than a
refinement bridges."""

APART_RAD = math.radians(20)
"""The same in yaw, rad."""

OTHER_PLACE = 0.5
"""Distance from which two poses are at different places, in radii of the object: half of where it
would stand in itself."""

CLEAR_NATS = math.log(20.0)
"""Log odds from which one hypothesis is clearly better than another: 20 to 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A pose hypothesis.

    Attributes:
        fit: the pose and its statistics.
        support: what the picture says for it.
        log_prior: nats, against the object being nowhere in view.
    """

    fit: Fit
    support: PoseSupport
    log_prior: float = 0.0

    @property
    def world_from_object(self) -> Pose:
        """Of the fit."""
        return self.fit.world_from_object

    @property
    def log_odds(self) -> float:
        """Nats of the object at this pose against its being nowhere in view."""
        return self.support.nats + self.log_prior

    def is_clearly_better(self, other: Hypothesis) -> bool:
        """Whether the odds of this hypothesis against another leave no reasonable doubt."""
        return self.log_odds > other.log_odds + CLEAR_NATS


def distinct(model: TrackModel, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best of those that say the same, the best first."""
    distinct: list[Hypothesis] = []
    for hypothesis in sorted(hypotheses, key=lambda hypothesis: -hypothesis.log_odds):
        pose = hypothesis.world_from_object
        if all(is_other(model, pose, other.world_from_object) for other in distinct):
            distinct.append(hypothesis)
    return distinct


def is_other(model: TrackModel, world_from_a: Pose, world_from_b: Pose) -> bool:
    """Whether two poses of an object differ by more than a refinement would even out."""
    if apart(world_from_a, world_from_b) > APART * model.radius_m:
        return True
    apart_rad = np.array([world_from_a.yaw() - world_from_b.yaw()])
    return bool(are_other_turns(model, apart_rad, min_rad=APART_RAD)[0])


def are_other_turns(model: TrackModel, apart_rad: Points, *, min_rad: float) -> NDArray[np.bool_]:
    """(N,) whether an object looks different when turned by more than `min_rad`."""
    if model.symmetry == ROUND:
        return np.zeros(len(apart_rad), np.bool_)
    turns = (apart_rad * model.symmetry + math.pi) % (2 * math.pi) - math.pi
    turns = np.abs(turns) / model.symmetry
    return (turns > min_rad) & np.logical_not(model.are_same(turns))


def apart(world_from_a: Pose, world_from_b: Pose) -> float:
    """Metres between two poses of an object."""
    return float(np.linalg.norm(world_from_a.translation - world_from_b.translation))
