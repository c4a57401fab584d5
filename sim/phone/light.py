"""A physical room with its objects as they stand: every mesh in the world, under its light.

Static meshes hold their light already, but not the objects' shadows; objects hold none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.rays import RayScene
from sim.bodies import Placement, body_of_object, solids_in_world
from sim.camera.shadows import ShadowMap, shadow_map
from sim.camera.tessellate import refine_mesh
from sim.phone.raster import LitMesh

OBJECT_EDGE_M = 0.02
OFF_SURFACE_M = 2e-3
AMBIENT_RAYS = 96
AMBIENT_REACH_M = 0.8
KEY_RAYS = 24
KEY_SPREAD = 0.35
KEY_REACH_M = 1.2
ON_PLANE_M = 1e-3


def still_scene(room: PhysicalRoom) -> list[LitMesh]:
    """All meshes of the room in world coordinates, lit, with the objects' shadows."""
    shadows = [_shadow(room, item) for item in room.objects]
    lit = [_static(mesh, shadows) for mesh in room.static]
    scene = RayScene(np.concatenate([_triangles(room), *map(_object_triangles, room.objects)]))
    for item in room.objects:
        for mesh in item.meshes:
            fine = refine_mesh(mesh, max_edge_m=OBJECT_EDGE_M)
            where = item.world_from_object @ fine.vertices
            normals = fine.normals @ item.world_from_object.rotation.T
            light = _light(room, scene, where, normals)
            lit.append(
                LitMesh(where, fine.uv, fine.faces, fine.texture, np.repeat(light[:, None], 3, 1))
            )
    return lit


def _static(mesh: TexturedMesh, shadows: Sequence[ShadowMap]) -> LitMesh:
    texture = mesh.texture.copy()
    for shadow in shadows:
        _darken(texture, mesh, shadow)
    return LitMesh(mesh.vertices, mesh.uv, mesh.faces, texture, np.ones((len(mesh.vertices), 3)))


def _shadow(room: PhysicalRoom, item: PhysicalObject) -> ShadowMap:
    body = body_of_object(item)
    height = float(item.world_from_object.translation[2])
    placement = Placement((item.world_from_object,), height)
    return shadow_map(
        solids_in_world(body, placement),
        height,
        light_direction=room.light_direction,
        ambient=room.ambient,
        key=room.key,
    )


def _darken(texture: NDArray[np.uint8], mesh: TexturedMesh, shadow: ShadowMap) -> None:
    """Multiply the texels of the surface that a shadow falls on by the light it leaves."""
    height, width = texture.shape[:2]
    left = np.ones((height, width), np.float32)
    reach = shadow.cell_m * shadow.light.shape[0]
    corners = mesh.vertices[mesh.faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    flat = (np.abs(corners[:, :, 2] - shadow.plane_z_m) < ON_PLANE_M).all(axis=1)
    near = (high[:, :2] > shadow.low_xy).all(axis=1) & (low[:, :2] < shadow.low_xy + reach).all(1)
    for face in mesh.faces[flat & near]:
        # Texel centres are whole numbers here.
        at = mesh.uv[face] * (width, -height) + (-0.5, height - 0.5)
        x0, y0 = (int(v) for v in np.ceil(at.min(axis=0) - 1e-3))
        x1, y1 = (int(v) for v in np.floor(at.max(axis=0) + 1e-3))
        x, y = np.meshgrid(np.arange(x0, x1 + 1), np.arange(y0, y1 + 1))
        edges = np.stack([at[1] - at[0], at[2] - at[0]], axis=1)
        if abs(np.linalg.det(edges)) < 1e-9:
            continue
        b = np.stack([x - at[0, 0], y - at[0, 1]], axis=-1) @ np.linalg.inv(edges).T
        inside = (b[..., 0] >= 0) & (b[..., 1] >= 0) & (b.sum(axis=-1) < 1)
        corner = mesh.vertices[face]
        where = corner[0] + b[inside] @ (corner[1:] - corner[0])
        left[y[inside], x[inside]] = _sampled(shadow, where[:, :2])
    rows, columns = np.nonzero(left < 1.0)
    texture[rows, columns] = np.round(texture[rows, columns] * left[rows, columns, None])


def _sampled(shadow: ShadowMap, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) light at points of the surface, bilinear; 1 outside the map."""
    cells = len(shadow.light)
    at = (xy - shadow.low_xy) / shadow.cell_m - 0.5
    known = ((at >= 0) & (at < cells - 1)).all(axis=1)
    column, row = np.clip(np.floor(at), 0, cells - 2).astype(int).T
    s, t = np.clip(at.T - (column, row), 0.0, 1.0)
    grid = shadow.light
    top = (1 - s) * grid[row, column] + s * grid[row, column + 1]
    low = (1 - s) * grid[row + 1, column] + s * grid[row + 1, column + 1]
    return np.where(known, (1 - t) * top + t * low, 1.0)


def _light(
    room: PhysicalRoom,
    scene: RayScene,
    where: NDArray[np.float64],
    normals: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N,) `ambient · openness + key · free share of the window · n·l` at world points."""
    origins = where + OFF_SURFACE_M * normals
    openness, free = np.zeros(len(where)), np.zeros(len(where))
    for direction in _sphere(AMBIENT_RAYS):
        ray = normals + 0.999 * direction
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        openness += np.minimum(scene.cast(origins, ray).distance / AMBIENT_REACH_M, 1.0)
    for direction in _sphere(KEY_RAYS):
        soft = room.light_direction + KEY_SPREAD * direction
        ray = np.broadcast_to(soft / np.linalg.norm(soft), where.shape)
        free += scene.cast(origins, ray).distance >= KEY_REACH_M
    key = room.key * np.maximum(normals @ room.light_direction, 0.0) * free / KEY_RAYS
    return room.ambient * openness / AMBIENT_RAYS + key


def _sphere(count: int) -> NDArray[np.float64]:
    """(N, 3) unit vectors spread evenly over the sphere (golden spiral)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def _triangles(room: PhysicalRoom) -> NDArray[np.float64]:
    return np.concatenate([mesh.vertices[mesh.faces] for mesh in room.static])


def _object_triangles(item: PhysicalObject) -> NDArray[np.float64]:
    return np.concatenate([(item.world_from_object @ m.vertices)[m.faces] for m in item.meshes])
