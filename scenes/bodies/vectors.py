"""Vectors and rotations in batches: every function takes leading axes of any number.

Written out in components where numpy's own function takes ten times as long for a few rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

TINY = 1e-9
"""Length below which a vector has no direction, metres: far below any bone's."""


def cross(a: Array, b: Array) -> Array:
    """Return a × b along the last axis."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def dot(a: Array, b: Array) -> Array:
    """Return a · b along the last axis."""
    return np.einsum("...i,...i->...", a, b)


def length(a: Array) -> Array:
    """Return |a| along the last axis."""
    return np.sqrt(np.einsum("...i,...i->...", a, a))


def unit(a: Array) -> Array:
    """Return a / |a| along the last axis; what has no length stays about zero."""
    return a / np.maximum(length(a), TINY)[..., None]


def across(a: Array, axis: Array) -> Array:
    """Return the unit vector of the part of `a` that is perpendicular to the unit `axis`."""
    return unit(a - dot(a, axis)[..., None] * axis)


def frame(along: Array, towards: Array) -> Array:
    """Return rotations (..., 3, 3) with columns `along`, `towards` made perpendicular, their cross.

    Args:
        along: unit vectors.
        towards: any vector that is not parallel to it.
    """
    second = across(towards, along)
    along, second = np.broadcast_arrays(along, second)
    return np.stack([along, second, cross(along, second)], axis=-1)


def turned(rotation: Array, vector: Array) -> Array:
    """Return rotation @ vector for each."""
    return np.einsum("...ij,...j->...i", rotation, vector)


def back(rotation: Array, vector: Array) -> Array:
    """Return rotationᵀ @ vector for each."""
    return np.einsum("...ji,...j->...i", rotation, vector)


def about(axis: Array, angle: ArrayLike, vector: Array) -> Array:
    """Return vectors turned about unit axes by angles in radians (Rodrigues)."""
    angle = np.asarray(angle, dtype=np.float64)
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    return vector * c + cross(axis, vector) * s + axis * (dot(axis, vector)[..., None] * (1.0 - c))


def rotation_about(axis: Array, angle: ArrayLike) -> Array:
    """Return rotations (..., 3, 3) about unit axes by angles in radians."""
    angle = np.asarray(angle, dtype=np.float64)
    shape = np.broadcast_shapes(axis.shape[:-1], angle.shape)
    axis, angle = np.broadcast_to(axis, (*shape, 3)), np.broadcast_to(angle, shape)
    columns = [about(axis, angle, np.broadcast_to(row, (*shape, 3))) for row in np.eye(3)]
    return np.stack(columns, axis=-1)


def yaw_rotation(yaw: Array) -> Array:
    """Return rotations (..., 3, 3) about world z, radians."""
    c, s, o = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    rows = [np.stack([c, -s, o], -1), np.stack([s, c, o], -1), np.stack([o, o, o + 1.0], -1)]
    return np.stack(rows, axis=-2)


def wrapped(angle: Array) -> Array:
    """Return angles in radians as -pi..pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def smooth(x: Array) -> Array:
    """Return a step from 0 at 0 to 1 at 1 that is level at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
