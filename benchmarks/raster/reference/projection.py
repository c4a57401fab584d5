"""How the lenses project points and their neighbourhoods, and the chain rule through both.

`project` gives a point's pixel and the Jacobian of the pixel by the point; `undo_projection` takes
gradients by both back to the point. Points are in camera axes, metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

JACOBIAN_MARGIN = 0.15
"""Share of the picture's size outside its border beyond which a pinhole's Jacobian is frozen: there
the linear approximation of EWA would spread a splat over the picture. As in Kerbl et al. 2023, "3D
Gaussian splatting"."""
ANGLE_MARGIN = 1.15
"""Factor on a fisheye's `max_angle` up to which centres of splats are drawn: a splat just outside
the lens reaches into it. Chosen on the built-in rooms."""
POLE_MARGIN_RAD = 0.05
"""Angle around straight behind a fisheye, radians, in which no splat is drawn: the direction away
from the axis is not defined there. Chosen on the built-in rooms."""
NEAR_AXIS = 1e-3
"""Tangent of the angle off axis below which the slope of R / s is taken from its series: the
difference of two nearly equal numbers over a small one would lose its digits."""


def focal_px(camera: Pinhole | Fisheye) -> float:
    """Pixels per radian on the axis."""
    return float(np.sqrt(camera.fx * camera.fy)) if isinstance(camera, Pinhole) else camera.f_px


def project(
    camera: Pinhole | Fisheye, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Pixels, depths and Jacobians of points (N, 3) in camera axes, metres.

    Returns:
        Pixels (N, 2); depths (N,) in metres, z for a pinhole and range for a fisheye; Jacobians
        (N, 2, 3) in px/m; and (N,) whether the lens draws a splat centred there.
    """
    if isinstance(camera, Pinhole):
        return _project_pinhole(camera, points)
    return _project_fisheye(camera, points)


def undo_projection(
    camera: Pinhole | Fisheye,
    points: FloatArray,
    d_pixels: FloatArray,
    d_depths: FloatArray,
    d_jacobians: FloatArray,
) -> FloatArray:
    """Gradients (N, 3) of points from those of what `project` gives for them.

    Args:
        camera: the lens.
        points: (N, 3) in camera axes, metres, all drawable.
        d_pixels: (N, 2).
        d_depths: (N,).
        d_jacobians: (N, 2, 3).
    """
    if isinstance(camera, Pinhole):
        return _undo_pinhole(camera, points, d_pixels, d_depths, d_jacobians)
    return _undo_fisheye(camera, points, d_pixels, d_depths, d_jacobians)


@dataclass(frozen=True, slots=True, eq=False)
class _PinholeTerms:
    """g = f / z, τ = (x, y) / z: pixel = f τ + centre and J = [diag(g), -g · clamped τ].

    Attributes:
        focal: (2,) px.
        z: (N, 1) metres, 1 behind the camera.
        gains: (N, 2) g, px/m.
        tangents: (N, 2) τ.
        clamped: (N, 2) τ within the margin beyond which the Jacobian is frozen.
    """

    focal: FloatArray
    z: FloatArray
    gains: FloatArray
    tangents: FloatArray
    clamped: FloatArray

    @staticmethod
    def of(camera: Pinhole, points: FloatArray) -> _PinholeTerms:
        """Of points (N, 3) in camera axes."""
        z = np.where(points[:, 2:] > 1e-9, points[:, 2:], 1.0)
        focal, centre = _focal_and_centre(camera)
        size = np.array([camera.width_px, camera.height_px], dtype=np.float64)
        margin = JACOBIAN_MARGIN * size
        tangents = points[:, :2] / z
        low, high = (-margin - centre) / focal, (size + margin - centre) / focal
        return _PinholeTerms(focal, z, focal / z, tangents, np.clip(tangents, low, high))


def _focal_and_centre(camera: Pinhole) -> tuple[FloatArray, FloatArray]:
    return np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])


def _project_pinhole(
    camera: Pinhole, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    terms = _PinholeTerms.of(camera, points)
    _, centre = _focal_and_centre(camera)
    jacobians = np.zeros((len(points), 2, 3))
    jacobians[:, 0, 0], jacobians[:, 1, 1] = terms.gains.T
    jacobians[:, :, 2] = -terms.gains * terms.clamped
    pixels = terms.focal * terms.tangents + centre
    return pixels, points[:, 2], jacobians, points[:, 2] > 1e-9


def _undo_pinhole(
    camera: Pinhole,
    points: FloatArray,
    d_pixels: FloatArray,
    d_depths: FloatArray,
    d_jacobians: FloatArray,
) -> FloatArray:
    terms = _PinholeTerms.of(camera, points)
    d_diagonal = np.stack([d_jacobians[:, 0, 0], d_jacobians[:, 1, 1]], axis=1)
    d_last = d_jacobians[:, :, 2]
    d_gains = d_diagonal - terms.clamped * d_last
    # Beyond the margin the Jacobian does not follow the tangent; the pixel does everywhere.
    follows = terms.clamped == terms.tangents
    d_tangents = terms.focal * d_pixels - np.where(follows, terms.gains * d_last, 0.0)
    d_xy = d_tangents / terms.z
    d_z = -(terms.tangents * d_tangents + terms.gains * d_gains).sum(axis=1, keepdims=True)
    return np.concatenate([d_xy, d_z / terms.z + d_depths[:, None]], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _FisheyeTerms:
    """In the axes of each point: e away from the lens's axis, n around it, and z.

    With s the distance from the axis, r the range and R(θ) the lens's radius, pixel = R e + centre
    and J = [ρ e eᵀ + τ n nᵀ, a e] with ρ = R' z / r², τ = R / s and a = -R' s / r². A step along e
    changes s alone; a step along n turns e by n / s and n by -e / s.

    Attributes:
        s: (N,) metres.
        e: (N, 2) unit.
        n: (N, 2) unit.
        angles: (N,) θ, radians.
        radii: (N,) R, px.
        slope: (N,) R', px/rad.
        square: (N,) r², 1 at the lens itself.
        rho: (N,) px/m.
        tau: (N,) px/m.
        a: (N,) px/m.
    """

    s: FloatArray
    e: FloatArray
    n: FloatArray
    angles: FloatArray
    radii: FloatArray
    slope: FloatArray
    square: FloatArray
    rho: FloatArray
    tau: FloatArray
    a: FloatArray

    @staticmethod
    def of(camera: Fisheye, points: FloatArray) -> _FisheyeTerms:
        """Of points (N, 3) in camera axes."""
        xy, z = points[:, :2], points[:, 2]
        s = np.hypot(points[:, 0], points[:, 1])
        on_axis = s < 1e-12 * np.abs(z)
        safe_s = np.where(on_axis, 1.0, s)
        e = np.where(on_axis[:, None], [1.0, 0.0], xy / safe_s[:, None])
        n = np.stack([-e[:, 1], e[:, 0]], axis=1)
        ranges = np.linalg.norm(points, axis=1)
        square = np.where(ranges > 0, ranges, 1.0) ** 2
        angles = np.arctan2(s, z)
        slope = camera.f_px * camera.radius_slope(angles)
        radii = camera.radius_px(angles)
        tau = np.where(on_axis, camera.f_px / np.where(z != 0, z, 1.0), radii / safe_s)
        rho, a = slope * z / square, -(slope * s / square)
        return _FisheyeTerms(s, e, n, angles, radii, slope, square, rho, tau, a)


def _project_fisheye(
    camera: Fisheye, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    t = _FisheyeTerms.of(camera, points)
    ranges = np.linalg.norm(points, axis=1)
    limit = min(ANGLE_MARGIN * camera.max_angle, np.pi - POLE_MARGIN_RAD)
    jacobians = np.zeros((len(points), 2, 3))
    jacobians[:, :, :2] = t.rho[:, None, None] * t.e[:, :, None] * t.e[:, None, :]
    jacobians[:, :, :2] += t.tau[:, None, None] * t.n[:, :, None] * t.n[:, None, :]
    jacobians[:, :, 2] = t.a[:, None] * t.e
    pixels = t.radii[:, None] * t.e + np.array([camera.cx, camera.cy])
    return pixels, ranges, jacobians, (t.angles <= limit) & (ranges > 0)


def _undo_fisheye(
    camera: Fisheye,
    points: FloatArray,
    d_pixels: FloatArray,
    d_depths: FloatArray,
    d_jacobians: FloatArray,
) -> FloatArray:
    t = _FisheyeTerms.of(camera, points)
    s, z, slope, square = t.s, points[:, 2], t.slope, t.square
    bend = camera.f_px * camera.radius_bend(t.angles)
    # dθ = (z ds - s dz) / r²; a has by s the slope that ρ has by z.
    rho_by_s = (bend * z - 2.0 * slope * s) * z / square**2
    rho_by_z = (slope * (s * s - z * z) - bend * s * z) / square**2
    a_by_z = (bend * s + 2.0 * slope * z) * s / square**2
    is_near = s < NEAR_AXIS * z
    cubic = 2.0 * camera.distortion[0] - 2.0 / 3.0
    series = cubic * camera.f_px * s / np.where(is_near, z, 1.0) ** 3
    tau_by_s = np.where(is_near, series, (t.rho - t.tau) / np.where(is_near, 1.0, s))
    tau_by_z = -slope / square

    d_along, d_across = _dot(d_pixels, t.e), _dot(d_pixels, t.n)
    d_square = d_jacobians[:, :, :2]
    d_rho = np.einsum("ni,nij,nj->n", t.e, d_square, t.e)
    d_tau = np.einsum("ni,nij,nj->n", t.n, d_square, t.n)
    d_mixed = np.einsum("ni,nij,nj->n", t.n, d_square + np.swapaxes(d_square, 1, 2), t.e)
    d_a, d_aside = _dot(d_jacobians[:, :, 2], t.e), _dot(d_jacobians[:, :, 2], t.n)

    d_s = t.rho * d_along + rho_by_s * d_rho + tau_by_s * d_tau + rho_by_z * d_a
    d_z = t.a * d_along + rho_by_z * d_rho + tau_by_z * d_tau + a_by_z * d_a
    d_n = t.tau * d_across + tau_by_s * d_mixed - slope / square * d_aside
    d_xy = d_s[:, None] * t.e + d_n[:, None] * t.n
    away = points / np.sqrt(square)[:, None]
    return np.concatenate([d_xy, d_z[:, None]], axis=1) + d_depths[:, None] * away


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return (a * b).sum(axis=1)
