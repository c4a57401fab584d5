"""Other yaws of an object at a place, the likeliest by its templates."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence
from tracking.hypotheses.hypothesis import APART_RAD, are_other_turns
from tracking.model.object_model import TrackModel
from tracking.model.templates import YAWS, compare, cut_out

Points = NDArray[np.float64]

NEARER = np.arange(-2, 3) * 0.2
"""Steps about a place at which templates are compared, in radii: another yaw of the same outline
lies beside the one that was found."""

PROPOSED = 4
"""Yaws proposed."""


def likeliest_yaws(
    model: TrackModel, evidence: Evidence, world_from_expected: Pose, *, count: int = PROPOSED
) -> list[Pose]:
    """Poses of an object at any yaw about its expected position, the likeliest first.

    Args:
        model: the object.
        evidence: its window.
        world_from_expected: where it is, its yaw aside.
        count: at most so many.
    """
    free = np.maximum(evidence.foreground, evidence.hidden)
    own = evidence.own * (1.0 - evidence.hidden)
    picture = np.dstack([evidence.live, own, free]).astype(np.float32)
    x, y = np.meshgrid(NEARER, NEARER)
    steps = model.radius_m * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    places: Points = world_from_expected.translation + steps
    cuts = cut_out(
        picture,
        evidence.camera,
        evidence.world_from_camera,
        places + model.centre_m,
        model.radius_m,
    )
    overlap, correlation = compare(cuts, model.templates)
    scores = overlap * (1.0 + np.maximum(correlation, 0.0))
    yaws = np.arange(YAWS) * (2 * math.pi / YAWS) + cuts.azimuth_rad[:, None]
    found: list[Pose] = []
    for index in np.argsort(-scores, axis=None, kind="stable"):
        row, turn = divmod(int(index), YAWS)
        if scores[row, turn] <= 0.0 or len(found) == count:
            break
        yaw = float(yaws[row, turn])
        apart = np.array([yaw - other.yaw() for other in found])
        if are_other_turns(model, apart, min_rad=1.5 * APART_RAD).all():
            found.append(Pose.from_yaw(yaw, places[row]))
    return found
