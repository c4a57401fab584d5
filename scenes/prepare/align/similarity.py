"""Rigid motion with one scale: what separates a reconstruction from the metric world."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.harmonics import turned
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Similarity:
    """A transform `a_from_b`: `x_in_a = scale · rotation @ x_in_b + translation`.

    Attributes:
        scale: units of a per unit of b, > 0.
        rotation: (3, 3) float64, orthonormal with determinant +1.
        translation: (3,) float64 in units of a.

    Raises:
        ValueError: the scale is not positive and finite, or the rest is no rigid transform.
    """

    scale: float
    rotation: FloatArray
    translation: FloatArray

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"Similarity.scale: {self.scale}, wanted finite and > 0")
        rigid = Pose(self.rotation, self.translation)
        object.__setattr__(self, "scale", float(self.scale))
        object.__setattr__(self, "rotation", rigid.rotation)
        object.__setattr__(self, "translation", rigid.translation)

    @staticmethod
    def identity() -> Similarity:
        """The transform that changes nothing."""
        return Similarity(1.0, np.eye(3), np.zeros(3))

    @staticmethod
    def from_pose(a_from_b: Pose, scale: float = 1.0) -> Similarity:
        """The rigid transform after scaling about the origin of b."""
        return Similarity(scale, a_from_b.rotation, a_from_b.translation)

    @overload
    def __matmul__(self, other: Similarity) -> Similarity: ...
    @overload
    def __matmul__(self, other: FloatArray) -> FloatArray: ...
    def __matmul__(self, other: Similarity | FloatArray) -> Similarity | FloatArray:
        """Compose with a similarity, or map points of shape (..., 3)."""
        if isinstance(other, Similarity):
            rigid = Pose(self.rotation, np.zeros(3)) @ Pose(other.rotation, np.zeros(3))
            return Similarity(
                self.scale * other.scale, rigid.rotation, self @ np.asarray(other.translation)
            )
        points = np.asarray(other, dtype=np.float64)
        return self.scale * (points @ self.rotation.T) + self.translation

    def inverse(self) -> Similarity:
        """`b_from_a` of `a_from_b`."""
        return Similarity(
            1.0 / self.scale, self.rotation.T, -self.rotation.T @ self.translation / self.scale
        )

    def matrix(self) -> FloatArray:
        """The (4, 4) homogeneous matrix."""
        m = np.eye(4)
        m[:3, :3] = self.scale * self.rotation
        m[:3, 3] = self.translation
        return m

    def moved(self, b_from_x: Pose) -> Pose:
        """`a_from_x` of an object whose own lengths are in units of a: a camera, a code.

        The pose stays rigid: its place is scaled, its axes only turn.
        """
        rotation = Pose(self.rotation, np.zeros(3)) @ Pose(b_from_x.rotation, np.zeros(3))
        return Pose(rotation.rotation, self @ b_from_x.translation)

    def moved_cloud(self, cloud: SplatCloud) -> SplatCloud:
        """The splats in a: places and sizes scaled, view-dependent colour turned, exactly."""
        scaled = SplatCloud(
            (cloud.means.astype(np.float64) * self.scale).astype(np.float32),
            (cloud.scales.astype(np.float64) * self.scale).astype(np.float32),
            cloud.rotations,
            cloud.opacities,
            cloud.sh,
        )
        return turned(scaled, Pose(self.rotation, self.translation))

    def moved_reconstruction(self, reconstruction: Reconstruction) -> Reconstruction:
        """The views and points in a. The pictures look as before: a pinhole knows no scale."""
        views = tuple(
            View(view.name, view.image, view.camera, self.moved(view.world_from_camera))
            for view in reconstruction.views
        )
        return replace(reconstruction, views=views, points=self @ reconstruction.points)


def similarity_from_points(
    in_a: ArrayLike, in_b: ArrayLike, *, weights: ArrayLike | None = None
) -> Similarity:
    """`a_from_b` that maps points onto each other with the least weighted squares.

    Source: Umeyama 1991, "Least-squares estimation of transformation parameters between two point
    patterns", equations 40 to 42.

    Args:
        in_a: (N, 3) places in a, N ≥ 3.
        in_b: (N, 3) the same places in b.
        weights: (N,) ≥ 0; equal if not given.

    Raises:
        ValueError: fewer than three points, or they lie on a line, so that no rotation is best.
    """
    a, b = np.asarray(in_a, dtype=np.float64), np.asarray(in_b, dtype=np.float64)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != 3 or len(a) < 3:
        raise ValueError(f"similarity: shapes {a.shape} and {b.shape}, wanted twice (N >= 3, 3)")
    w = np.ones(len(a)) if weights is None else np.asarray(weights, dtype=np.float64)
    w = w / w.sum()
    centre_a, centre_b = w @ a, w @ b
    from_a, from_b = a - centre_a, b - centre_b
    u, sizes, vt = np.linalg.svd((w[:, None] * from_a).T @ from_b)
    if sizes[1] <= 1e-12 * max(sizes[0], 1e-300):
        raise ValueError("similarity: the points lie on one line; give one that is beside it")
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * signs) @ vt
    spread = float(w @ np.einsum("na,na->n", from_b, from_b))
    scale = float(sizes @ signs) / spread
    return Similarity(scale, rotation, centre_a - scale * rotation @ centre_b)
