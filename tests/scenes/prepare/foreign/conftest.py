"""A furnished room of flat splats, 4 x 5 x 2.6 m, whose surfaces are known; floor at z = 0."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.pose import quaternion_from_rotation
from scenes.splats import SplatCloud, concatenate

STEP_M = 0.08
TABLE = ((0.6, 0.8, 0.72), (1.4, 0.0, 0.0), (0.0, 0.8, 0.0))
PATCHES = (
    ((-2.0, -2.5, 0.0), (4.0, 0.0, 0.0), (0.0, 5.0, 0.0)),
    ((-2.0, -2.5, 2.6), (4.0, 0.0, 0.0), (0.0, 5.0, 0.0)),
    ((-2.0, -2.5, 0.0), (0.0, 5.0, 0.0), (0.0, 0.0, 2.6)),
    ((2.0, -2.5, 0.0), (0.0, 5.0, 0.0), (0.0, 0.0, 2.6)),
    ((-2.0, -2.5, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 2.6)),
    ((-2.0, 2.5, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 2.6)),
    TABLE,
)


def _patch(corner, u, v):
    corner, u, v = (np.asarray(x, dtype=np.float64) for x in (corner, u, v))
    across, along = (round(float(np.linalg.norm(x)) / STEP_M) for x in (u, v))
    s, t = np.meshgrid((np.arange(across) + 0.5) / across, (np.arange(along) + 0.5) / along)
    means = corner + s.reshape(-1, 1) * u + t.reshape(-1, 1) * v
    axes = np.stack([u / np.linalg.norm(u), v / np.linalg.norm(v)], axis=1)
    rotation = np.column_stack([axes, np.cross(axes[:, 0], axes[:, 1])])
    n = len(means)
    return SplatCloud(
        means,
        np.tile([STEP_M * 0.7, STEP_M * 0.7, 0.002], (n, 1)),
        np.tile(quaternion_from_rotation(rotation), (n, 1)),
        np.full(n, 0.95),
        np.zeros((n, 1, 3)),
    )


@pytest.fixture(scope="session")
def flat_room() -> SplatCloud:
    """World frame, metres."""
    return concatenate([_patch(*patch) for patch in PATCHES])


@pytest.fixture(scope="session")
def patches():
    """(7, 2, 3, 3) triangles of its surfaces."""
    corners = np.array(PATCHES)
    o, u, v = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.stack(
        [np.stack([o, o + u, o + v], axis=1), np.stack([o + u, o + u + v, o + v], axis=1)], axis=1
    ).reshape(-1, 3, 3)
