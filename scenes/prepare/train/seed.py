# pyright: standard
"""The first splats: flat ones, on the surfaces that the photos show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from scenes.cameras import pixel_centres
from scenes.harmonics import SH_C0
from scenes.prepare.cells import cells_of
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.depth.seen_surfaces import Surface, judge
from scenes.prepare.train.optimiser.rows import TrainingRows, rows_of_cloud
from scenes.prepare.train.training_photos import typical_distance
from scenes.splats import SplatCloud

NEIGHBOURS = 3
"""Neighbours whose mean distance is a first splat's size."""

AROUND = 10
"""Neighbours, itself among them, by which a surface's direction is estimated."""

FIRST_OPACITY = 0.3
"""Opacity of first splats."""

MIN_POINTS = 10
"""Fewer points than this say nothing about a room."""

SPACING = 0.025
"""Of the points that stereo adds, as a share of the distance at which the photos see the scene."""

FIRST_SHARE = 0.4
"""Of the budget, at most: the rest goes where the error is."""

FLATTEST = 0.2
"""Thickness of a first splat over its width at least."""

MIN_PIXELS = 10
"""Pixels, of all views, that have to see something in a cell of space before it is believed."""


def seed_rows(
    reconstruction: Reconstruction,
    surfaces: Sequence[Surface],
    sh_count: int,
    budget: int,
    rng: np.random.Generator,
) -> TrainingRows:
    """Splats as wide as the distance to their neighbours, and as thick as the neighbourhood is.

    The width is that of Kerbl et al. 2023, section 5.1.

    Args:
        reconstruction: its points and colours.
        surfaces: what stereo has seen; may be empty.
        sh_count: coefficients per splat; all but the first are zero.
        budget: splats at most; of more points a sample is taken.
        rng: draws that sample.

    Raises:
        ValueError: there are too few points.
    """
    points = reconstruction.points
    if len(points) < MIN_POINTS:
        raise ValueError(
            f"training: {len(points)} points to start from, wanted at least {MIN_POINTS}; "
            "film again with more overlap and texture"
        )
    colours = reconstruction.colours.astype(np.float32)
    if surfaces:
        more = dense_points(surfaces, SPACING * typical_distance(reconstruction))
        count = min(len(more.points), max(round(FIRST_SHARE * budget) - len(points), 0))
        added = np.sort(rng.choice(len(more.points), count, replace=False))
        points = np.concatenate([points, more.points[added]])
        colours = np.concatenate([colours, more.colours[added]])
    if len(points) > budget:
        chosen = np.sort(rng.choice(len(points), budget, replace=False))
        points, colours = points[chosen], colours[chosen]
    return rows_of_cloud(_discs(points, colours), sh_count)


def _discs(points: NDArray[np.float64], colours: NDArray[np.float32]) -> SplatCloud:
    distances, near = KDTree(points).query(points, k=min(AROUND, len(points)))
    spacing = np.sqrt(np.mean(distances[:, 1 : NEIGHBOURS + 1] ** 2, axis=1))
    # Points on top of each other would start without any width, lonely ones as wide as the room.
    spacing = np.clip(spacing, *np.quantile(spacing, [0.02, 0.98]))
    spacing = np.maximum(spacing, 1e-6 * max(float(np.ptp(points)), 1e-6))
    around = points[near] - points[near].mean(axis=1, keepdims=True)
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    thin = np.sqrt(np.maximum(spread[:, 0], 0) / np.maximum(spread[:, 1], 1e-30))
    scales = np.repeat(spacing[:, None], 3, axis=1)
    scales[:, 0] *= np.clip(thin, FLATTEST, 1)
    turned = np.linalg.det(axes) < 0
    axes[turned, :, 2] *= -1
    return SplatCloud(
        points.astype(np.float32),
        scales.astype(np.float32),
        Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]].astype(np.float32),
        np.full(len(points), FIRST_OPACITY, dtype=np.float32),
        ((colours / 255 - 0.5) / SH_C0)[:, None, :].astype(np.float32),
    )


@dataclass(frozen=True, slots=True, eq=False)
class DensePoints:
    """Points on surfaces.

    Attributes:
        points: (N, 3) world.
        colours: (N, 3) float32, 0..255.
    """

    points: NDArray[np.float64]
    colours: NDArray[np.float32]


def dense_points(surfaces: Sequence[Surface], spacing: float) -> DensePoints:
    """One point for each cell of space in which enough pixels see a surface.

    Args:
        surfaces: of all views; what is only filled in makes no points.
        spacing: side of a cell, in the world's unit.
    """
    points, colours = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for surface in surfaces:
        seen = np.flatnonzero(surface.is_seen)
        rays = surface.camera.unproject(pixel_centres(surface.camera)[seen])
        places = rays * (surface.depth.ravel()[seen] / rays[:, 2])[:, None]
        points.append(surface.world_from_camera @ places)
        colours.append(surface.picture.reshape(-1, 3)[seen].astype(np.float64))
    every = np.hstack([np.concatenate(points), np.concatenate(colours)])
    cells, cell = cells_of(every[:, :3], spacing)
    count = np.bincount(cell, minlength=len(cells))
    sums = [np.bincount(cell, column, len(count)) for column in every.T]
    means = (np.stack(sums, axis=1) / count[:, None])[count >= MIN_PIXELS]
    verdict = judge(means[:, :3], surfaces)
    kept = ~verdict.is_stray
    return DensePoints((means[:, :3] + verdict.offset)[kept], means[kept, 3:].astype(np.float32))
