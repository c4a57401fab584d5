"""Errors against the truth, in the paper's units and columns (paper section 5)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.model.symmetry import ROUND

PAPER_ROOM = {
    "x_cm": (5.6, 6.3),
    "y_cm": (5.3, 5.1),
    "z_cm": (2.7, 4.6),
    "world_cm": (9.9, 4.4),
    "yaw_deg": (5.7, 12.0),
}
PAPER_TABLE = {
    "x_cm": (5.0, 1.7),
    "y_cm": (2.2, 1.0),
    "z_cm": (2.9, 1.9),
    "world_cm": (7.5, 1.7),
    "yaw_deg": (3.2, 4.6),
}
"""Mean and standard deviation of the paper's tables 1 (chair, room) and 2 (book, table)."""


@dataclass(frozen=True, slots=True)
class PoseError:
    """How far an estimated pose is from the true one.

    Attributes:
        x_cm: absolute error along world x; y_cm and z_cm likewise.
        world_cm: distance.
        yaw_deg: absolute yaw error, 0 for a round object.
    """

    x_cm: float
    y_cm: float
    z_cm: float
    world_cm: float
    yaw_deg: float


@dataclass(frozen=True, slots=True)
class Spread:
    """Mean, population standard deviation, 95th percentile and maximum of `count` values."""

    mean: float
    std: float
    p95: float
    max: float
    count: int


def pose_error(
    estimated: Pose,
    true: Pose,
    *,
    symmetry: int = 1,
    centre_m: tuple[float, float, float] = (0, 0, 0),
) -> PoseError:
    """Compare two `world_from_object` poses.

    Args:
        estimated: by a tracker.
        true: by the truth.
        symmetry: how many yaws in a turn look the same: 1 for a chair, 2 for a plain box, `ROUND`
            for a round stool, whose yaw nobody can see.
        centre_m: point of the object whose position counts; the object's origin by default.

    Raises:
        ValueError: the symmetry is negative.
    """
    if symmetry < 0:
        raise ValueError(f"pose_error: symmetry {symmetry}, wanted 0 (round), 1, 2, ...")
    point = np.asarray(centre_m, dtype=np.float64)
    apart = np.abs(estimated @ point - true @ point) * 100.0
    yaw = 0.0
    if symmetry != ROUND:
        turn = 2.0 * math.pi / symmetry
        difference = (estimated.yaw() - true.yaw()) % turn
        yaw = math.degrees(min(difference, turn - difference))
    return PoseError(
        float(apart[0]), float(apart[1]), float(apart[2]), float(np.linalg.norm(apart)), yaw
    )


def pose_errors(
    estimated: NDArray[np.float64], true: NDArray[np.float64], *, symmetry: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances and yaw errors of many poses at once: as `pose_error` gives them one by one.

    Args:
        estimated: (N, 12), nine row-major numbers of the rotation and three of the place in metres.
        true: (N, 12), likewise.
        symmetry: see `pose_error`.

    Returns:
        (N,) distances in cm and (N,) yaw errors in degrees.
    """
    world_cm = 100.0 * np.linalg.norm(estimated[:, 9:12] - true[:, 9:12], axis=1)
    if symmetry == ROUND:
        return world_cm, np.zeros(len(world_cm))
    turn = 2.0 * math.pi / symmetry
    difference = (_yaws(estimated) - _yaws(true)) % turn
    return world_cm, np.degrees(np.minimum(difference, turn - difference))


def _yaws(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) radians of (N, 12) poses, see `Pose.yaw`."""
    return np.arctan2(poses[:, 3] - poses[:, 1], poses[:, 0] + poses[:, 4])


def spread(values: Sequence[float] | NDArray[np.float64]) -> Spread:
    """Summarise values.

    Raises:
        ValueError: there are none.
    """
    v = np.asarray(values, dtype=np.float64)
    if v.size == 0:
        raise ValueError("spread: no values")
    return Spread(
        float(v.mean()), float(v.std()), float(np.percentile(v, 95)), float(v.max()), int(v.size)
    )


def error_table(errors: Sequence[PoseError]) -> Mapping[str, Spread]:
    """The paper's columns: x_cm, y_cm, z_cm, world_cm, yaw_deg.

    Raises:
        ValueError: there are no errors to summarise.
    """
    return {
        column: spread([getattr(error, column) for error in errors])
        for column in ("x_cm", "y_cm", "z_cm", "world_cm", "yaw_deg")
    }
