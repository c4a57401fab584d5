# pyright: standard
"""One scale per axis, as in the paper: an option for captures with a bad lens, with a warning.

A calibrated reconstruction is right up to a similarity. That codes come out with unequal sides
means that the lens model or the poses are wrong. Stretching the world hides that and does not heal
it: turned splats and view-dependent colour no longer fit exactly. So the stretch is measured and
told, and applied only on demand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import CollisionMesh
from scenes.pose import Pose, quaternion_from_rotation
from scenes.prepare.align.alignment import Alignment
from scenes.prepare.reconstruction import Reconstruction
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

UNSEEN = 1e-3
"""Axes that no code's side runs along keep the mean scale: their pull, relative to a side's."""


@dataclass(frozen=True, slots=True)
class AxisScale:
    """Factors along the world's axes.

    Attributes:
        factors: (x, y, z), each > 0; 1 changes nothing.

    Raises:
        ValueError: a factor is not positive and finite.
    """

    factors: tuple[float, float, float]

    def __post_init__(self) -> None:
        if not all(np.isfinite(f) and f > 0 for f in self.factors):
            raise ValueError(f"AxisScale: factors {self.factors}, wanted finite and > 0")

    @property
    def anisotropy(self) -> float:
        """Largest factor over smallest, minus 1; 0 for a similarity."""
        return max(self.factors) / min(self.factors) - 1.0

    def warning(self) -> str:
        """A sentence for the report."""
        x, y, z = self.factors
        return (
            f"The codes' sides differ by {100 * self.anisotropy:.2f} % between axes "
            f"(x {x:.4f}, y {y:.4f}, z {z:.4f}). Stretching the axes apart hides an error of the "
            "lens or the poses and shears turned splats; better calibrate the lens and film again."
        )

    def moved(self, points: FloatArray) -> FloatArray:
        """(..., 3) world points, stretched."""
        return np.asarray(points, dtype=np.float64) * np.array(self.factors)

    def moved_pose(self, world_from_thing: Pose) -> Pose:
        """A pose at its stretched place; it stays rigid, and keeps its direction."""
        return Pose(world_from_thing.rotation, self.moved(world_from_thing.translation))

    def moved_reconstruction(self, reconstruction: Reconstruction) -> Reconstruction:
        """Views and points at their stretched places."""
        views = tuple(
            replace(view, world_from_camera=self.moved_pose(view.world_from_camera))
            for view in reconstruction.views
        )
        return replace(reconstruction, views=views, points=self.moved(reconstruction.points))

    def moved_mesh(self, mesh: CollisionMesh) -> CollisionMesh:
        """A mesh with stretched vertices."""
        vertices = self.moved(mesh.vertices.astype(np.float64))
        return CollisionMesh(vertices.astype(np.float32), mesh.faces)

    def moved_alignment(self, alignment: Alignment) -> Alignment:
        """The codes at their stretched places, and the warning beside the others."""
        anchors = tuple(
            replace(
                anchor,
                world_from_code=self.moved_pose(anchor.world_from_code),
                corners_m=self.moved(anchor.corners_m),
            )
            for anchor in alignment.anchors
        )
        return replace(
            alignment,
            anchors=anchors,
            references_m=self.moved(alignment.references_m),
            warnings=(*alignment.warnings, self.warning()),
        )

    def moved_cloud(self, cloud: SplatCloud) -> SplatCloud:
        """Splats with stretched places and covariances; view-dependent colour stays as it is."""
        stretch = np.array(self.factors)
        covariances = stretch[:, None] * cloud.covariances() * stretch
        variances, axes = np.linalg.eigh(covariances)
        axes[:, :, 0] *= np.sign(np.linalg.det(axes))[:, None]
        quaternions = np.stack([quaternion_from_rotation(r) for r in axes])
        return SplatCloud(
            self.moved(cloud.means.astype(np.float64)).astype(np.float32),
            np.sqrt(np.maximum(variances, 1e-16)).astype(np.float32),
            quaternions.astype(np.float32),
            cloud.opacities,
            cloud.sh,
        )


def measured_axis_scale(alignment: Alignment) -> AxisScale:
    """The stretch that gives every code's sides their printed length.

    Linear least squares of |D edge|² = side² over the freely measured corners, for D². An axis
    without any side along it stays at the mean.

    Raises:
        ValueError: the alignment has no codes.
    """
    if not alignment.anchors:
        raise ValueError("axis scale: the alignment has no codes to measure sides of")
    rows, ones = [], []
    for anchor in alignment.anchors:
        edges = (np.roll(anchor.corners_m, -1, axis=0) - anchor.corners_m) / anchor.side_m
        rows.append(edges**2)
        ones.append(np.ones(4))
    a, b = np.concatenate(rows), np.concatenate(ones)
    mean_square = float(b.sum() / a.sum())
    pull = UNSEEN * np.eye(3)
    squares = mean_square + np.linalg.solve(a.T @ a + pull, a.T @ (b - mean_square * a.sum(axis=1)))
    x, y, z = np.sqrt(np.maximum(squares, 1e-6)).tolist()
    return AxisScale((x, y, z))
