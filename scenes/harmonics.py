"""Real spherical harmonics in the order and signs of 3D Gaussian splatting, and how they turn.

Source: Kerbl et al. 2023 (the constants are those of Green 2003, "Spherical Harmonic Lighting").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.splats import SH_C0, SH_COUNTS, SplatCloud

C1 = 0.4886025119029199
C2 = (1.0925484305920792, 0.31539156525252005, 0.5462742152960396)
C3 = (
    0.5900435899266435,
    2.890611442640554,
    0.4570457994644658,
    0.3731763325901154,
    1.445305721320277,
)
"""Factors of the bands' polynomials; that of degree 0 is `SH_C0`."""

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
        -C1 * y,
        C1 * z,
        -C1 * x,
        C2[0] * x * y,
        -C2[0] * y * z,
        C2[1] * (2.0 * zz - xx - yy),
        -C2[0] * x * z,
        C2[2] * (xx - yy),
        -C3[0] * y * (3.0 * xx - yy),
        C3[1] * x * y * z,
        -C3[2] * y * (4.0 * zz - xx - yy),
        C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -C3[2] * x * (4.0 * zz - xx - yy),
        C3[4] * z * (xx - yy),
        -C3[0] * x * (xx - 3.0 * yy),
    ]
    return np.stack(values[: SH_COUNTS[degree]], axis=1)


def slopes(directions: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """Derivatives of `basis` by x, y and z, of the polynomials as they stand there.

    They differ off the sphere from those of other ways to write the same functions: only their part
    at right angles to the direction has a meaning.

    Args:
        directions: (N, 3) unit vectors.
        degree: 0 to 3.

    Returns:
        (N, (degree + 1)², 3).
    """
    x, y, z = directions.T
    o = np.zeros_like(x)
    xx, yy, zz = x * x, y * y, z * z
    rows = [
        (1.0, (o, o, o)),
        (-C1, (o, o + 1.0, o)),
        (C1, (o, o, o + 1.0)),
        (-C1, (o + 1.0, o, o)),
        (C2[0], (y, x, o)),
        (-C2[0], (o, z, y)),
        (C2[1], (-2.0 * x, -2.0 * y, 4.0 * z)),
        (-C2[0], (z, o, x)),
        (C2[2], (2.0 * x, -2.0 * y, o)),
        (-C3[0], (6.0 * x * y, 3.0 * (xx - yy), o)),
        (C3[1], (y * z, x * z, x * y)),
        (-C3[2], (-2.0 * x * y, 4.0 * zz - xx - 3.0 * yy, 8.0 * y * z)),
        (C3[3], (-6.0 * x * z, -6.0 * y * z, 6.0 * zz - 3.0 * xx - 3.0 * yy)),
        (-C3[2], (4.0 * zz - 3.0 * xx - yy, -2.0 * x * y, 8.0 * x * z)),
        (C3[4], (2.0 * x * z, -2.0 * y * z, xx - yy)),
        (-C3[0], (3.0 * (xx - yy), -6.0 * x * y, o)),
    ]
    return np.stack(
        [factor * np.stack(slope, axis=1) for factor, slope in rows[: SH_COUNTS[degree]]], axis=1
    )


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
