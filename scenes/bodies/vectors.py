"""Vectors and rotations in batches: every function takes leading axes of any number.

Written out in components where numpy's own function takes ten times as long for a few rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

TINY = 1e-9
"""Length below which a vector has no direction, metres: far below any bone's."""


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def packed(*parts: Array) -> Array:
    """Return arrays of one shape side by side along a new last axis."""
    found = np.empty((*parts[0].shape, len(parts)))
    for place, part in enumerate(parts):
        found[..., place] = part
    return found


def cross(a: Array, b: Array) -> Array:
    """Return a × b along the last axis."""
    return a.take(_NEXT, -1) * b.take(_LAST, -1) - a.take(_LAST, -1) * b.take(_NEXT, -1)


def dot(a: Array, b: Array) -> Array:
    """Return a · b along the last axis."""
    return np.vecdot(a, b)


def length(a: Array) -> Array:
    """Return |a| along the last axis."""
    return np.sqrt(np.vecdot(a, a))


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
    shape = np.broadcast_shapes(along.shape, second.shape)
    found = np.empty((*shape, 3))
    found[..., 0], found[..., 1], found[..., 2] = along, second, cross(along, second)
    return found


def turned(rotation: Array, vector: Array) -> Array:
    """Return rotation @ vector for each."""
    return np.matvec(rotation, vector)


def back(rotation: Array, vector: Array) -> Array:
    """Return rotationᵀ @ vector for each."""
    return np.vecmat(vector, rotation)


def about(axis: Array, angle: ArrayLike, *, vector: Array) -> Array:
    """Return vectors turned about unit axes by angles in radians (Rodrigues)."""
    angle = np.asarray(angle, dtype=np.float64)
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    return vector * c + cross(axis, vector) * s + axis * (dot(axis, vector)[..., None] * (1.0 - c))


def yaw_rotation(yaw: Array) -> Array:
    """Return rotations (..., 3, 3) about world z, radians."""
    found = np.zeros((*yaw.shape, 3, 3))
    found[..., 0, 0] = found[..., 1, 1] = np.cos(yaw)
    found[..., 1, 0] = np.sin(yaw)
    found[..., 0, 1] = -found[..., 1, 0]
    found[..., 2, 2] = 1.0
    return found


def wrapped(angle: Array) -> Array:
    """Return angles in radians as -pi..pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def smooth(x: Array) -> Array:
    """Return a step from 0 at 0 to 1 at 1 that is level at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
