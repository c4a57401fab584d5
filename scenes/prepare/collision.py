# pyright: standard
"""The room's hidden mesh, from its splats.

Depth pictures of the splats are fused in a truncated signed distance volume (Curless and Levoy
1996); the mesh is its zero surface, thinned.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.prepare.progress import Progress, silent
from scenes.prepare.surface_depth import surface_depth
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

VOXEL_SHARE = 1 / 120
"""Finest detail, as a share of the typical distance: 2.5 cm at 3 m."""
MIN_VOXEL_M = 0.02
"""Finest detail in a small room, metres."""
REACH_VOXELS = 4.0
"""How far from a surface the signed distance is kept; surfaces thinner than twice that may
vanish."""
SKY_SHARE = 8.0
"""Depth from which on it is sky, or as good as, over that of the nearest quarter of a picture."""
FARTHEST_SHARE = 4.0
"""How far the fused surface reaches, in typical distances."""
MIN_VIEWS = 1.5
"""A surface that fewer views have seen is left out."""
NO_SURFACE = "the splats show no surface that two views agree about; train longer"
PICTURE_PX = (320, 240)
"""Largest size of the depth pictures, px."""
MAX_FACES = 60_000
"""Triangles of a room's mesh, for the physics' sake."""
MIN_BODY_FACES = 60
"""Triangles below which a connected piece is a speck."""


def mesh_of_splats(
    cloud: SplatCloud,
    views: Sequence[tuple[Pinhole, Pose]],
    *,
    renderer: NativeRenderer,
    progress: Progress = silent,
) -> CollisionMesh:
    """The surface that splats show to the given views.

    Args:
        cloud: the room, world metres.
        views: cameras with `world_from_camera`, spread over the room.
        renderer: draws the depth.
        progress: called after every view.

    Raises:
        ValueError: no view, or nothing is seen in any of them.
    """
    depths: list[tuple[Pinhole, Pose, NDArray[np.float32]]] = []
    for index, (camera, world_from_camera) in enumerate(views):
        small = _shrink(camera)
        depth = surface_depth(cloud, small, world_from_camera, renderer=renderer)
        if depth.any():
            depths.append((small, world_from_camera, depth))
        progress((index + 1) / len(views), f"view {index + 1} of {len(views)}")
    if not depths:
        raise ValueError("the splats show no surface to any view; is the room trained?")
    volume = _fuse(depths)
    try:
        surface = volume.extract_triangle_mesh(MIN_VIEWS)
    except RuntimeError:  # Open3D gives an empty mesh no colours, and stumbles over that
        raise ValueError(NO_SURFACE) from None
    return _tidy(surface.to_legacy())


def _fuse(depths: Sequence[tuple[Pinhole, Pose, NDArray[np.float32]]]) -> Any:
    """Fuse depth pictures, each with its camera and pose, in one volume of signed distances."""
    import open3d as o3d

    typical_m = float(np.median([typical_depth(depth) for _, _, depth in depths]))
    # Depth in metres, farthest first seen, and the reach of the signed distance in voxels.
    limits = (1.0, FARTHEST_SHARE * typical_m, REACH_VOXELS)
    tensor: Any = o3d.core.Tensor
    single = o3d.core.float32
    grid: Any = o3d.t.geometry.VoxelBlockGrid
    volume = grid(
        attr_names=("tsdf", "weight"),
        attr_dtypes=(single, single),
        attr_channels=((1), (1)),
        voxel_size=max(VOXEL_SHARE * typical_m, MIN_VOXEL_M),
        block_resolution=16,
        block_count=4096,
    )
    for small, world_from_camera, depth in depths:
        near = np.where(depth < limits[1], depth, 0.0).astype(np.float32)
        if not near.any():
            continue
        picture = o3d.t.geometry.Image(tensor(near))
        lens = tensor(small.opencv_matrix())
        camera_from_world = tensor(world_from_camera.inverse().matrix())
        blocks = volume.compute_unique_block_coordinates(picture, lens, camera_from_world, *limits)
        volume.integrate(blocks, picture, lens, camera_from_world, *limits)
    return volume


def typical_depth(depth: NDArray[np.float32]) -> float:
    """Median of what is seen in a depth picture, the sky left out: a few metres, not its dome's.

    Args:
        depth: (H, W) metres, 0 where nothing is; something has to be.
    """
    seen = depth[depth > 0]
    return float(np.median(seen[seen <= SKY_SHARE * np.quantile(seen, 0.25)]))


def _shrink(camera: Pinhole) -> Pinhole:
    scale = min(1.0, PICTURE_PX[0] / camera.width_px, PICTURE_PX[1] / camera.height_px)
    return Pinhole(
        max(1, round(camera.width_px * scale)),
        max(1, round(camera.height_px * scale)),
        camera.fx * scale,
        camera.fy * scale,
        camera.cx * scale,
        camera.cy * scale,
    )


def _tidy(mesh: Any) -> CollisionMesh:
    """Without specks, thinned to what a collision needs."""
    clusters, sizes, _ = mesh.cluster_connected_triangles()
    small = np.asarray(sizes)[np.asarray(clusters)] < MIN_BODY_FACES
    mesh.remove_triangles_by_mask(small)
    mesh.remove_unreferenced_vertices()
    faces = np.asarray(mesh.triangles)
    if not len(faces):
        raise ValueError(NO_SURFACE)
    if len(faces) > MAX_FACES:
        mesh = mesh.simplify_quadric_decimation(MAX_FACES)
    return CollisionMesh(
        np.asarray(mesh.vertices),
        np.asarray(mesh.triangles),
    )
