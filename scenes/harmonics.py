"""Real spherical harmonics in the order and signs of 3D Gaussian splatting, and how they turn.

Source: Kerbl et al. 2023 (the constants are those of Green 2003, "Spherical Harmonic Lighting").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.splats import SH_C0, SH_COUNTS, SplatCloud

SNAP = 1e-12
"""Entries of a turning matrix this near to -1, 0 or 1 are that, so that axis flips are exact."""


def basis(directions: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """Values of all basis functions up to `degree`.

    Args:
        directions: (N, 3) unit vectors from the camera to the splat.
        degree: 0 to 3.

    Returns:
        (N, (degree + 1)²) in the order of the coefficients of `SplatCloud.sh`.
    """
    x, y, z = directions.T
    xx, yy, zz = x * x, y * y, z * z
    values = [
        np.full_like(x, SH_C0),
        -0.4886025119029199 * y,
        0.4886025119029199 * z,
        -0.4886025119029199 * x,
        1.0925484305920792 * x * y,
        -1.0925484305920792 * y * z,
        0.31539156525252005 * (2.0 * zz - xx - yy),
        -1.0925484305920792 * x * z,
        0.5462742152960396 * (xx - yy),
        -0.5900435899266435 * y * (3.0 * xx - yy),
        2.890611442640554 * x * y * z,
        -0.4570457994644658 * y * (4.0 * zz - xx - yy),
        0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.4570457994644658 * x * (4.0 * zz - xx - yy),
        1.445305721320277 * z * (xx - yy),
        -0.5900435899266435 * x * (xx - 3.0 * yy),
    ]
    return np.stack(values[: SH_COUNTS[degree]], axis=1)


def turning_matrix(rotation: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """(K, K) matrix that turns coefficients: sh_in_a = matrix @ sh_in_b for `a_from_b` rotation.

    Exact for any rotation, since a turned band is a linear combination of the same band; found by
    solving basis(Rᵀ d) = basis(d) · M on well-spread directions.
    """
    count = 64
    k = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1.0 - 2.0 * k / count), np.pi * (1.0 + np.sqrt(5.0)) * k
    directions = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1
    )
    in_a, in_b = basis(directions, degree), basis(directions @ rotation, degree)
    matrix = np.zeros((SH_COUNTS[degree], SH_COUNTS[degree]))
    for band in range(degree + 1):
        rows = slice(band * band, (band + 1) ** 2)
        matrix[rows, rows] = np.linalg.lstsq(in_a[:, rows], in_b[:, rows], rcond=None)[0]
    nearest = np.round(matrix)
    return np.where(np.abs(matrix - nearest) < SNAP, nearest, matrix)


def turned(cloud: SplatCloud, a_from_b: Pose) -> SplatCloud:
    """The cloud in frame a, view-dependent colour included."""
    plain = SplatCloud(
        cloud.means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh[:, :1]
    ).transformed(a_from_b)
    matrix = turning_matrix(a_from_b.rotation, cloud.sh_degree)
    sh = np.einsum("jk,nkc->njc", matrix, cloud.sh.astype(np.float64)).astype(np.float32)
    return SplatCloud(plain.means, plain.scales, plain.rotations, plain.opacities, sh)
