"""Ray casting against triangles, on Open3D's Embree scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float32Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class RayHits:
    """Ends of N rays.

    Attributes:
        distance: (N,) in lengths of the direction; infinite where nothing was hit.
        triangle: (N,) int64 index, -1 where nothing was hit.
        normals: (N, 3) of the triangle hit; unit length.
    """

    distance: Float32Array
    triangle: NDArray[np.int64]
    normals: Float32Array


class RayScene:
    """Triangles that rays can hit.

    Args:
        triangles: (T, 3, 3) corners in metres, T at least 1.

    Raises:
        ImportError: Open3D or a system library that it needs is missing.
    """

    def __init__(self, triangles: NDArray[np.floating[Any]]) -> None:
        import open3d as o3d

        self._tensor: Any = o3d.core.Tensor
        self._scene: Any = o3d.t.geometry.RaycastingScene()
        corners = np.ascontiguousarray(triangles, dtype=np.float32).reshape(-1, 3)
        index = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
        self._scene.add_triangles(self._tensor(corners), self._tensor(index))
        self._count = len(index)

    def cast(
        self, origins: NDArray[np.floating[Any]], directions: NDArray[np.floating[Any]]
    ) -> RayHits:
        """The first triangle along each of N rays (origins and directions (N, 3))."""
        hits = self._scene.cast_rays(self._tensor(_bundle(origins, directions)))
        triangle = hits["primitive_ids"].numpy().astype(np.int64)
        triangle[triangle >= self._count] = -1
        return RayHits(hits["t_hit"].numpy(), triangle, hits["primitive_normals"].numpy())

    def blocked(
        self, origins: NDArray[np.floating[Any]], segments: NDArray[np.floating[Any]]
    ) -> NDArray[np.bool_]:
        """(N,) whether anything lies on the way from `origins` to `origins + segments`."""
        rays = self._tensor(_bundle(origins, segments))
        return self._scene.test_occlusions(rays, tnear=0.0, tfar=0.998).numpy()

    def distance(self, points: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """(N,) metres from points (N, 3) to the nearest triangle."""
        query = self._tensor(np.ascontiguousarray(points, dtype=np.float32))
        return self._scene.compute_distance(query).numpy().astype(np.float64)


def _bundle(
    origins: NDArray[np.floating[Any]], directions: NDArray[np.floating[Any]]
) -> Float32Array:
    rays = np.empty((len(origins), 6), dtype=np.float32)
    rays[:, :3], rays[:, 3:] = origins, directions
    return rays
