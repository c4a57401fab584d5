"""Metric alignment without codes: a length between two points."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.prepare.align.alignment import Alignment, bend_per_metre
from scenes.prepare.align.codes.triangulate import rays, triangulated
from scenes.prepare.align.gravity import Gravity, find_gravity, standing_world
from scenes.prepare.reconstruction import Reconstruction

FloatArray = NDArray[np.float64]

NO_ROTATION_RAD = 1e-6
"""Deviation added to each parameter, so that the covariance can be inverted."""
KNOWN_GROUPS = 1000
"""The uncertainty of a tape measure is given, not estimated from few photos."""


def picked_point(reconstruction: Reconstruction, picks_px: Mapping[str, ArrayLike]) -> FloatArray:
    """(3,) the point clicked on in several photos, in the reconstruction's frame.

    Args:
        reconstruction: photos with poses.
        picks_px: (2,) px by the photo's name, in two photos or more.

    Raises:
        ValueError: fewer than two photos, an unknown one, or they are from almost one place.
    """
    views = {view.name: view for view in reconstruction.views}
    unknown = [name for name in picks_px if name not in views]
    if unknown or len(picks_px) < 2:
        raise ValueError(
            f"picked point: {len(picks_px)} photo(s){', unknown: ' + unknown[0] if unknown else ''}"
            "; click the point in two photos or more of the reconstruction"
        )
    cast = [
        rays(views[name], np.asarray(px, dtype=np.float64).reshape(1, 2))
        for name, px in picks_px.items()
    ]
    directions = np.stack([direction[0] for _, direction in cast])
    angle = math.degrees(math.acos(float(np.clip((directions @ directions.T).min(), -1, 1))))
    if angle < 2.0:
        raise ValueError(
            f"picked point: the photos look along almost one line ({angle:.1f}°, wanted 2 or more);"
            " click it in photos from places further apart"
        )
    return triangulated(np.stack([place for place, _ in cast]), directions)


def align_by_length(
    reconstruction: Reconstruction,
    a: ArrayLike,
    b: ArrayLike,
    *,
    length_m: float,
    sigma_m: float = 0.002,
    rng: np.random.Generator,
) -> Alignment:
    """The metric world from two points and the length between them.

    The origin is on the floor under `a`; X points to `b` (to where the first photo looks, if `b` is
    above `a`).

    Args:
        reconstruction: photos with poses and sparse points.
        a: (3,) in the reconstruction's frame, such as a `picked_point`.
        b: the other end.
        length_m: between them, measured in the room.
        sigma_m: how well it was measured and clicked.
        rng: for the search of the floor.

    Raises:
        ValueError: the points coincide, or the length is none.
    """
    ends = np.stack([np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)])
    units = float(np.linalg.norm(ends[1] - ends[0]))
    if not (math.isfinite(length_m) and length_m > 0):
        raise ValueError(f"length: {length_m} m, wanted > 0; measure it in the room")
    if units < 1e-9:
        raise ValueError("length: both points are the same; click two that are far apart")
    gravity = find_gravity(reconstruction, rng=rng)
    along = (ends[1] - ends[0]) / units
    if abs(float(along @ gravity.up)) > 0.9:
        along = reconstruction.views[0].world_from_camera.rotation[:, 2]
    scale = length_m / units
    return standing_alignment(reconstruction, gravity, scale, ends, along, sigma_m / length_m)


def standing_alignment(
    reconstruction: Reconstruction,
    gravity: Gravity,
    scale: float,
    references: FloatArray,
    along: FloatArray,
    relative_sigma: float,
) -> Alignment:
    """The world of a scale that was measured at few places.

    Args:
        reconstruction: photos with poses and sparse points.
        gravity: up and floor.
        scale: metres per unit.
        references: (K, 3) where it was measured, in the reconstruction's frame; the world's origin
            is on the floor under the first.
        along: (3,) X's direction, as far as it is level.
        relative_sigma: deviation of the scale, as a share of it.
    """
    world_from_reconstruction = standing_world(gravity, references[0], along, scale)
    references_m = world_from_reconstruction @ references
    centre = references_m.mean(axis=0)
    # Only the scale is uncertain; it is measured at the references, which stay where they are.
    change = np.concatenate([np.zeros(3), -centre, [1.0]])
    covariance = relative_sigma**2 * np.outer(change, change)
    covariance += NO_ROTATION_RAD**2 * np.eye(7)
    warnings = (
        () if gravity.floor_points else ("No floor was found; up is taken from the cameras.",)
    )
    return Alignment(
        world_from_reconstruction,
        covariance,
        (),
        gravity,
        KNOWN_GROUPS,
        references_m,
        bend_per_metre(reconstruction),
        warnings,
    )
