"""Metric alignment without codes: a length between two points, or an object of known shape."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from scenes.prepare.align.alignment import Alignment, bend_per_metre
from scenes.prepare.align.gravity import Gravity, find_gravity, standing_world
from scenes.prepare.align.similarity import Similarity, similarity_from_points
from scenes.prepare.align.triangulate import rays, triangulated
from scenes.prepare.reconstruction import Reconstruction

FloatArray = NDArray[np.float64]

NO_ROTATION_RAD = 1e-6
KNOWN_GROUPS = 1000
"""The uncertainty of a tape measure is given, not estimated from few photos."""

NEAREST_STEPS = 60


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
    return _standing(reconstruction, gravity, scale, ends, along, sigma_m / length_m)


def align_by_object(
    reconstruction: Reconstruction,
    points: FloatArray,
    *,
    known_m: FloatArray,
    reconstruction_from_known: Similarity,
    rng: np.random.Generator,
) -> Alignment:
    """The metric world from an object whose true shape is known, such as an earlier cut-out.

    Iterated closest points with a scale (Besl & McKay 1992 with Umeyama's step), paired from both
    sides, as pairs from one side shrink the scale; the worst tenth of the pairs is left out.

    Args:
        reconstruction: photos with poses and sparse points.
        points: (N, 3) the object in the reconstruction's frame.
        known_m: (M, 3) the object in metres.
        reconstruction_from_known: a start; its scale within some 20 % of the truth.
        rng: for the search of the floor.

    Raises:
        ValueError: too few points, or the shapes do not fit each other.
    """
    if len(points) < 50 or len(known_m) < 50:
        raise ValueError(
            f"known object: {len(points)} and {len(known_m)} points, wanted 50 or more of each"
        )
    tree = KDTree(known_m)
    every = max(1, len(known_m) // 2000)
    asked = known_m[::every]
    known_from_reconstruction = reconstruction_from_known.inverse()
    distances = np.zeros(len(points))
    for _ in range(NEAREST_STEPS):
        moved = known_from_reconstruction @ points
        distances, nearest = (np.asarray(a) for a in tree.query(moved))
        back, nearest_back = (np.asarray(a) for a in KDTree(moved).query(asked))
        keep = distances <= np.quantile(distances, 0.9)
        keep_back = back <= np.quantile(back, 0.9)
        known_from_reconstruction = similarity_from_points(
            np.concatenate([known_m[nearest[keep]], asked[keep_back]]),
            np.concatenate([points[keep], points[nearest_back[keep_back]]]),
        )
    extent_m = float(np.linalg.norm(np.ptp(known_m, axis=0)))
    spread_m = float(np.sqrt(np.mean(np.quantile(distances, [0.25, 0.5, 0.75]) ** 2)))
    if spread_m > 0.05 * extent_m:
        raise ValueError(
            f"known object: its points are {1000 * spread_m:.0f} mm from the known shape, limit "
            f"{50 * extent_m:.0f} (5 % of its size); choose another object or a better start"
        )
    gravity = find_gravity(reconstruction, rng=rng)
    centre = points.mean(axis=0)
    relative = max(spread_m / extent_m / math.sqrt(len(points) / 10), 1e-4)
    along = known_from_reconstruction.rotation.T[:, 0]
    if abs(float(along @ gravity.up)) > 0.9:
        along = known_from_reconstruction.rotation.T[:, 1]
    return _standing(
        reconstruction, gravity, known_from_reconstruction.scale, centre[None], along, relative
    )


def _standing(
    reconstruction: Reconstruction,
    gravity: Gravity,
    scale: float,
    references: FloatArray,
    along: FloatArray,
    relative_sigma: float,
) -> Alignment:
    """The world on the floor under the first reference, X along `along`."""
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
