"""Rigid transforms. `a_from_b @ x_in_b` gives `x_in_a`; names cancel in reading order."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

ORTHONORMAL_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A rigid transform `a_from_b`: `x_in_a = rotation @ x_in_b + translation`.

    Attributes:
        rotation: (3, 3) float64, orthonormal with determinant +1.
        translation: (3,) float64, metres.

    Raises:
        ValueError: a shape is wrong, a value is not finite, or the rotation is not a rotation.
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]

    def __post_init__(self) -> None:
        rotation = np.array(self.rotation, dtype=np.float64)
        translation = np.array(self.translation, dtype=np.float64)
        if rotation.shape != (3, 3):
            raise ValueError(f"Pose.rotation: shape {rotation.shape}, wanted (3, 3)")
        if translation.shape != (3,):
            raise ValueError(f"Pose.translation: shape {translation.shape}, wanted (3,)")
        # Plain numbers: thousands of poses are made a second, and numpy takes longer to be called.
        rows, place = rotation.tolist(), translation.tolist()
        if not all(map(math.isfinite, (*rows[0], *rows[1], *rows[2], *place))):
            raise ValueError(f"Pose: not finite: rotation {rotation}, translation {translation}")
        error, determinant = _off_rotation(*rows)
        if error > ORTHONORMAL_TOLERANCE or determinant < 0:
            raise ValueError(
                f"Pose.rotation: not a rotation: |R Rᵀ - I| = {error:.3g} "
                f"(limit {ORTHONORMAL_TOLERANCE:g}), det = {determinant:.3g}"
            )
        rotation.setflags(write=False)
        translation.setflags(write=False)
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)

    @staticmethod
    def identity() -> Pose:
        """The pose that changes nothing."""
        return Pose(np.eye(3), np.zeros(3))

    @staticmethod
    def from_yaw(yaw_rad: float, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Pose:
        """Turn by `yaw_rad` about the world's up axis (Z), then translate (metres)."""
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        place = np.array(translation, dtype=np.float64)
        if place.shape == (3,) and all(map(math.isfinite, (c, *place.tolist()))):
            return _unchecked(rotation, place)
        return Pose(rotation, place)

    @staticmethod
    def from_quaternion(wxyz: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Pose:
        """From a unit quaternion (w, x, y, z) and a translation in metres.

        Raises:
            ValueError: the norm differs from 1 by more than 1e-3.
        """
        q = np.asarray(wxyz, dtype=np.float64)
        norm = float(np.linalg.norm(q))
        if q.shape != (4,) or not abs(norm - 1.0) <= 1e-3:
            raise ValueError(
                f"quaternion wxyz {q.tolist()}: norm {norm:.6g}, wanted 4 numbers of norm 1 ± 0.001"
            )
        return Pose(rotation_from_quaternion(q), np.asarray(translation, dtype=np.float64))

    @staticmethod
    def from_matrix(matrix: ArrayLike) -> Pose:
        """From a (4, 4) homogeneous matrix with column vectors."""
        m = np.asarray(matrix, dtype=np.float64)
        if m.shape != (4, 4):
            raise ValueError(f"Pose.from_matrix: shape {m.shape}, wanted (4, 4)")
        return Pose(m[:3, :3], m[:3, 3])

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def __matmul__(self, other: Pose | NDArray[np.float64]) -> Pose | NDArray[np.float64]:
        """Compose with a pose, or map points of shape (..., 3)."""
        if isinstance(other, Pose):
            return _unchecked(
                renormalised(self.rotation.dot(other.rotation)),
                self.rotation.dot(other.translation) + self.translation,
            )
        points = np.asarray(other, dtype=np.float64)
        return points @ self.rotation.T + self.translation

    def inverse(self) -> Pose:
        """`b_from_a` of `a_from_b`."""
        return _unchecked(self.rotation.T.copy(), -self.rotation.T.dot(self.translation))

    def matrix(self) -> NDArray[np.float64]:
        """The (4, 4) homogeneous matrix."""
        m = np.eye(4)
        m[:3, :3] = self.rotation
        m[:3, 3] = self.translation
        return m

    def quaternion(self) -> NDArray[np.float64]:
        """Unit quaternion (w, x, y, z) with w >= 0, float64."""
        return quaternion_from_rotation(self.rotation)

    def yaw(self) -> float:
        """Rotation about up (Z) in radians: the yaw nearest to this rotation (swing-twist)."""
        r = self.rotation
        return math.atan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1])


def _unchecked(rotation: NDArray[np.float64], translation: NDArray[np.float64]) -> Pose:
    """A pose of fresh arrays that are a rotation and a place because of how they were made.

    Thousands are made a second; a distance that overflows is refused where it enters.
    """
    pose = object.__new__(Pose)
    rotation.setflags(write=False)
    translation.setflags(write=False)
    object.__setattr__(pose, "rotation", rotation)
    object.__setattr__(pose, "translation", translation)
    return pose


def _off_rotation(a: list[float], b: list[float], c: list[float]) -> tuple[float, float]:
    """Largest entry of |R Rᵀ - I|, and the determinant, of a matrix with these three rows."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = a, b, c
    error = max(
        abs(ax * ax + ay * ay + az * az - 1.0),
        abs(bx * bx + by * by + bz * bz - 1.0),
        abs(cx * cx + cy * cy + cz * cz - 1.0),
        abs(ax * bx + ay * by + az * bz),
        abs(ax * cx + ay * cy + az * cz),
        abs(bx * cx + by * cy + bz * cz),
    )
    across = (by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx)
    return error, ax * across[0] + ay * across[1] + az * across[2]


def rotation_from_quaternion(wxyz: ArrayLike) -> NDArray[np.float64]:
    """(..., 4) quaternions (w, x, y, z), normalised here, to (..., 3, 3) rotations."""
    q = np.asarray(wxyz, dtype=np.float64)
    if q.ndim == 1:
        # Plain numbers: hundreds are turned a second, and numpy takes ten times as long for one.
        w, x, y, z = q.tolist()
        length = math.sqrt(w * w + x * x + y * y + z * z) or math.nan
        return np.array(_rows_of([w / length, x / length, y / length, z / length]))
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    rows = _rows_of(np.moveaxis(q, -1, 0))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _rows_of(wxyz: Iterable[Any]) -> list[list[Any]]:
    """Rows of the rotation of a quaternion of length 1; of numbers, or of arrays of them."""
    w, x, y, z = wxyz
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def quaternion_from_rotation(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) rotation to a unit quaternion (w, x, y, z) with w >= 0 (Shepperd's method)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    squares = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    largest = squares.index(max(squares))
    if largest == 0:
        parts = [squares[0], zy - yz, xz - zx, yx - xy]
    elif largest == 1:
        parts = [zy - yz, squares[1], xy + yx, xz + zx]
    elif largest == 2:
        parts = [xz - zx, xy + yx, squares[2], yz + zy]
    else:
        parts = [yx - xy, xz + zx, yz + zy, squares[3]]
    q = np.array(parts)
    length = math.sqrt(q.dot(q))
    return q / (-length if parts[0] < 0 else length)


def rotation_from_vector(rotation_vector: ArrayLike) -> NDArray[np.float64]:
    """SO(3) exponential: rotation vector (3,) in radians to a (3, 3) rotation (Rodrigues)."""
    v = np.asarray(rotation_vector, dtype=np.float64)
    angle = float(np.linalg.norm(v))
    if angle < 1e-12:
        return np.eye(3)
    half = 0.5 * angle
    return rotation_from_quaternion(np.concatenate([[math.cos(half)], math.sin(half) / angle * v]))


def rotation_angle(rotation: NDArray[np.float64]) -> float:
    """Angle in radians, 0..π, of a (3, 3) rotation."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    twice_sine = math.sqrt((zy - yz) ** 2 + (xz - zx) ** 2 + (yx - xy) ** 2)
    return math.atan2(twice_sine, xx + yy + zz - 1.0)


def interpolate(a: Pose, b: Pose, fraction: float) -> Pose:
    """Between `a` (fraction 0) and `b` (fraction 1): linear translation, spherical rotation."""
    qa, qb = a.quaternion(), b.quaternion()
    if float(qa @ qb) < 0:
        qb = -qb
    angle = math.acos(min(1.0, float(qa @ qb)))
    if angle < 1e-9:
        q = qa
    else:
        q = (math.sin((1 - fraction) * angle) * qa + math.sin(fraction * angle) * qb) / math.sin(
            angle
        )
    translation = (1 - fraction) * a.translation + fraction * b.translation
    return Pose(rotation_from_quaternion(q), translation)


def wrap_angle(angle_rad: float) -> float:
    """The same angle in [-π, π)."""
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi


def renormalised(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """One Newton step towards the nearest rotation, so that long chains do not drift."""
    return 1.5 * rotation - 0.5 * rotation.dot(rotation.T).dot(rotation)
