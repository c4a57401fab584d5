# pyright: standard
"""Rigid bodies of known size, placed in a reconstruction by all photos that show them.

A body is a printed square, or several whose mutual places are known. All bodies share one scale:
reconstruction units per metre. Least squares over every corner in every photo, with robust weights;
the covariance comes from leaving photos out, so that it holds the errors of their poses too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.reconstruction import View

FloatArray = NDArray[np.float64]

STEPS = 30
"""Steps of the adjustment at most."""
HUBER = 2.5
"""Residuals beyond so many standard deviations pull no harder."""

GROUPS = 12
"""Photos are left out in so many runs of neighbours: neighbours share their errors."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """Points of one body in one photo.

    Attributes:
        body: index of the body.
        points: (K,) which of its points.
        view: the photo.
        order: position of the photo among all photos; neighbours in time are neighbours here.
        pixels: (K, 2) px.
        sigma_px: (K,) px.
    """

    body: int
    points: NDArray[np.intp]
    view: View
    order: int
    pixels: FloatArray
    sigma_px: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Placed bodies, and how well their poses are known.

    Attributes:
        rotations: (B, 3, 3) reconstruction axes from body axes.
        translations: (B, 3) reconstruction units.
        metres_per_unit: shared scale.
        covariance: (6B + 1, 6B + 1): per body a rotation vector in the reconstruction's axes
            (radians) and a translation (units); last, the logarithm of `metres_per_unit`.
        residuals_px: one (K, 2) array an observation, seen minus predicted.
        pose_sigma_px: what the photos' poses add to the corners' own uncertainty.
        groups: how many independent groups of photos the covariance rests on.
    """

    rotations: FloatArray
    translations: FloatArray
    metres_per_unit: float
    covariance: FloatArray
    residuals_px: tuple[FloatArray, ...]
    pose_sigma_px: float
    groups: int


def place(
    bodies_m: Sequence[FloatArray],
    observations: Sequence[Observation],
    *,
    start: Sequence[Pose],
    metres_per_unit: float,
) -> Placement:
    """Least squares from a start near the answer.

    Args:
        bodies_m: (P, 3) points of each body in its own frame, metres.
        observations: each body in at least two photos from different places.
        start: reconstruction from body, per body, translation in reconstruction units.
        metres_per_unit: start of the scale.

    Raises:
        ValueError: the photos do not determine the bodies.
    """
    rotations = np.stack([pose.rotation for pose in start])
    translations = np.stack([pose.translation for pose in start])
    log_scale = float(np.log(metres_per_unit))
    pose_sigma_px = 0.5
    for step in range(STEPS):
        residuals, slopes = _linearise(bodies_m, observations, rotations, translations, log_scale)
        weights, pose_sigma_px = _weights(residuals, observations, pose_sigma_px, settle=step > 2)
        normal, pull = _normal_equations(residuals, slopes, weights)
        change = _solve(normal, pull)
        rotations = np.stack([_turn(r, change[6 * b : 6 * b + 3]) for b, r in enumerate(rotations)])
        translations = translations + np.stack(
            [change[6 * b + 3 : 6 * b + 6] for b in range(len(translations))]
        )
        log_scale += float(change[-1])
        if np.abs(change).max() < 1e-10 and step > 4:
            break
    residuals, slopes = _linearise(bodies_m, observations, rotations, translations, log_scale)
    weights, pose_sigma_px = _weights(residuals, observations, pose_sigma_px, settle=True)
    covariance, groups = _left_out(observations, residuals, slopes, weights)
    return Placement(
        rotations,
        translations,
        float(np.exp(log_scale)),
        covariance,
        tuple(residuals),
        pose_sigma_px,
        groups,
    )


def _turn(rotation: FloatArray, rotation_vector: FloatArray) -> FloatArray:
    turn = Pose(rotation_from_vector(rotation_vector), np.zeros(3))
    return (turn @ Pose(rotation, np.zeros(3))).rotation


def _linearise(
    bodies_m: Sequence[FloatArray],
    observations: Sequence[Observation],
    rotations: FloatArray,
    translations: FloatArray,
    log_scale: float,
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Residuals (K, 2) and slopes (K, 2, 6B + 1) of the prediction, per observation."""
    residuals, slopes = [], []
    count = 6 * len(bodies_m) + 1
    for seen in observations:
        arms = np.exp(-log_scale) * bodies_m[seen.body][seen.points] @ rotations[seen.body].T
        predicted, by_place = _project(seen.view, arms + translations[seen.body])
        slope = np.zeros((len(arms), 2, count))
        first = 6 * seen.body
        slope[:, :, first : first + 3] = by_place @ -_cross_matrices(arms)
        slope[:, :, first + 3 : first + 6] = by_place
        slope[:, :, -1] = -np.einsum("kij,kj->ki", by_place, arms)
        residuals.append(seen.pixels - predicted)
        slopes.append(slope)
    return residuals, slopes


def _project(view: View, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Pixels (K, 2) of places and how they move with the place (K, 2, 3)."""
    camera_from_world = view.world_from_camera.inverse()
    in_camera = camera_from_world @ places
    tiny = 1e-5 * float(np.linalg.norm(in_camera, axis=1).mean())
    moves = tiny * np.concatenate([np.eye(3), -np.eye(3), np.zeros((1, 3))])
    around = (in_camera[:, None] + moves).reshape(-1, 3)
    pixels = view.camera.project(around)[0].reshape(len(places), 7, 2)
    by_camera = np.swapaxes(pixels[:, :3] - pixels[:, 3:6], 1, 2) / (2 * tiny)
    return pixels[:, 6], by_camera @ camera_from_world.rotation


def _weights(
    residuals: Sequence[FloatArray],
    observations: Sequence[Observation],
    pose_sigma_px: float,
    *,
    settle: bool,
) -> tuple[list[FloatArray], float]:
    """Weight per point: inverse variance, less for outliers; and the poses' share of the noise."""
    lengths = [np.linalg.norm(r, axis=1) for r in residuals]
    if settle:
        # The median length of a two-dimensional normal residual is 1.1774 standard deviations.
        typical = float(np.median(np.concatenate(lengths))) / 1.1774
        own = float(np.median(np.concatenate([o.sigma_px for o in observations])))
        pose_sigma_px = float(np.sqrt(max(typical**2 - own**2, 0.0)))
    weights = []
    for length, seen in zip(lengths, observations, strict=True):
        sigma = np.hypot(seen.sigma_px, pose_sigma_px)
        weights.append(1.0 / (sigma * sigma * np.maximum(1.0, length / (HUBER * sigma))))
    return weights, pose_sigma_px


def _normal_equations(
    residuals: Sequence[FloatArray], slopes: Sequence[FloatArray], weights: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    count = slopes[0].shape[2]
    normal, pull = np.zeros((count, count)), np.zeros(count)
    for r, j, w in zip(residuals, slopes, weights, strict=True):
        rows = j.reshape(-1, count)
        weighted = rows * np.repeat(w, 2)[:, None]
        normal += rows.T @ weighted
        pull += weighted.T @ r.ravel()
    return normal, pull


def _solve(normal: FloatArray, pull: FloatArray) -> FloatArray:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * scale[:, None] * scale
    if np.linalg.cond(scaled) > 1e13:
        raise ValueError(
            "alignment: the photos do not show how large the codes are; film each code from places "
            "at least half a metre apart"
        )
    return scale * np.linalg.solve(scaled, scale * pull)


def _left_out(
    observations: Sequence[Observation],
    residuals: Sequence[FloatArray],
    slopes: Sequence[FloatArray],
    weights: Sequence[FloatArray],
) -> tuple[FloatArray, int]:
    """Covariance by leaving out one run of neighbouring photos at a time.

    Source: Bell & McCaffrey 2002, the jackknife estimator (CR3) of a clustered covariance. It is
    conservative for few groups, and never taken below what the corners' own noise would give.
    """
    normal, _ = _normal_equations(residuals, slopes, weights)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    photos = sorted({seen.order for seen in observations})
    groups = np.array_split(np.array(photos), min(GROUPS, len(photos)))
    scatter = np.zeros_like(normal)
    used = 0
    for group in groups:
        index = [k for k, seen in enumerate(observations) if seen.order in set(group.tolist())]
        part, pull = _normal_equations(
            [residuals[k] for k in index], [slopes[k] for k in index], [weights[k] for k in index]
        )
        rest = normal - part
        try:
            shift = _solve(rest, pull)
        except (ValueError, np.linalg.LinAlgError):
            continue
        scatter += np.outer(shift, shift)
        used += 1
    if used < 2:
        return 4.0 * inverse, 2
    covariance = scatter * (used - 1) / used
    return _at_least(covariance, inverse), used


def _at_least(covariance: FloatArray, floor: FloatArray) -> FloatArray:
    """The smallest covariance that is nowhere below either."""
    root = np.linalg.cholesky(floor)
    back = np.linalg.inv(root)
    sizes, axes = np.linalg.eigh(back @ covariance @ back.T)
    grown = (axes * np.maximum(sizes, 1.0)) @ axes.T
    return root @ grown @ root.T


def _cross_matrices(vectors: FloatArray) -> FloatArray:
    """(K, 3, 3) matrices M with M @ b = vector × b."""
    return np.cross(vectors[:, None, :], np.eye(3)[None], axis=2).swapaxes(1, 2)
