"""The first splats: one at every point that structure from motion found."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from scenes.harmonics import SH_C0
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.training_rows import TrainingRows, rows_of_cloud
from scenes.splats import SplatCloud

NEIGHBOURS = 3
FIRST_OPACITY = 0.3
FEWEST_POINTS = 10
"""Fewer points than this say nothing about a room."""


def seed_rows(
    reconstruction: Reconstruction, sh_count: int, budget: int, rng: np.random.Generator
) -> TrainingRows:
    """Round splats as wide as the distance to their neighbours (Kerbl et al. 2023, section 5.1).

    Args:
        reconstruction: its points and colours.
        sh_count: coefficients per splat; all but the first are zero.
        budget: splats at most; of more points a sample is taken.
        rng: draws that sample.

    Raises:
        ValueError: there are too few points.
    """
    points = reconstruction.points
    if len(points) < FEWEST_POINTS:
        raise ValueError(
            f"training: {len(points)} points to start from, wanted at least {FEWEST_POINTS}; "
            "film again with more overlap and texture"
        )
    chosen = np.arange(len(points))
    if len(points) > budget:
        chosen = np.sort(rng.choice(len(points), budget, replace=False))
    points = points[chosen]
    distances, _ = KDTree(points).query(points, k=NEIGHBOURS + 1)
    spacing = np.sqrt(np.mean(distances[:, 1:] ** 2, axis=1))
    # Points on top of each other would start without any width, lonely ones as wide as the room.
    spacing = np.clip(spacing, *np.quantile(spacing, [0.02, 0.98]))
    spacing = np.maximum(spacing, 1e-6 * max(float(np.ptp(points)), 1e-6))
    n = len(points)
    colours = reconstruction.colours[chosen].astype(np.float32) / 255
    cloud = SplatCloud(
        points.astype(np.float32),
        np.repeat(spacing[:, None], 3, axis=1).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (n, 1)),
        np.full(n, FIRST_OPACITY, dtype=np.float32),
        ((colours - 0.5) / SH_C0)[:, None, :].astype(np.float32),
    )
    return rows_of_cloud(cloud, sh_count)
