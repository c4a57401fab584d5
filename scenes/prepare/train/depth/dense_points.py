"""Points all over the surfaces that the photos show, where structure from motion has but few."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import pixel_centres
from scenes.prepare.cells import cells_of
from scenes.prepare.train.depth.seen_surfaces import Surface, judge

MIN_PIXELS = 10
"""Pixels, of all views, that have to see something in a cell of space before it is believed."""


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
