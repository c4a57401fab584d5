"""The room's meshes as a HoloLens has them: surfaces, each a piece of the room, with versions."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.surface_mesh import MeshNumbers
from scenes.mesh import PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from sim.camera.tessellate import refine_mesh

Array = NDArray[np.float64]

CELL_M = 1.5
"""Side of the pieces, metres: a headset's surfaces are between 1 and 3 m."""

EDGE_M = 0.3
"""Longest edge of a triangle before the room is cut: a wall is no single triangle."""

MIN_GRID_M, GROWTH = 0.04, 1.4
"""Finest grid that vertices are gathered on, metres: what a headset resolves of furniture; and how
it grows until a surface has no more triangles than were asked for."""

MAX_GRIDS = 12
"""Grids that are tried: the coarsest is 2 m."""

VERSION_TICKS = 10_000_000
"""Time between two versions of surfaces at least, 100 ns: a second."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshedSurface:
    """One surface.

    Attributes:
        guid: 16 bytes.
        update_time: 100 ns since 1601.
        room_from_surface: where it is in the room.
        vertices_m: (V, 3) in its own frame.
        triangles: (T, 3), counter-clockwise seen from the free side.
    """

    guid: bytes
    update_time: int
    room_from_surface: Pose
    vertices_m: Array
    triangles: NDArray[np.int64]

    @property
    def radius_m(self) -> float:
        """Radius about its origin that holds all of it."""
        return float(np.linalg.norm(self.vertices_m, axis=1).max(initial=0.0))


class Meshing:
    """Surfaces of a room; any thread may ask and change.

    Args:
        room: whose meshes are cut.
        utc_ticks: coordinated time, 100 ns since 1601.
    """

    def __init__(self, room: PhysicalRoom, utc_ticks: int) -> None:
        self._lock = threading.Lock()
        self._time = utc_ticks
        self._surfaces: dict[str, MeshedSurface] = {}
        for name, (vertices, triangles) in _pieces(room).items():
            self.put(name, vertices, triangles=triangles)

    def put(self, name: str, vertices_in_room_m: Array, *, triangles: NDArray[np.int64]) -> None:
        """Have a surface, or another version of it."""
        centre = vertices_in_room_m.mean(axis=0)
        guid = blake2b(name.encode(), digest_size=16).digest()
        # The headset's own frames of surfaces are turned, too.
        room_from_surface = Pose.from_yaw(0.37 * (guid[0] % 17), centre)
        own = room_from_surface.inverse() @ vertices_in_room_m
        with self._lock:
            self._time += VERSION_TICKS
            self._surfaces[name] = MeshedSurface(
                guid, self._time, room_from_surface, own, triangles
            )

    def touch(self, name: str) -> None:
        """Have the same surface as a new version.

        Raises:
            KeyError: there is none.
        """
        with self._lock:
            self._time += VERSION_TICKS
            self._surfaces[name] = replace(self._surfaces[name], update_time=self._time)

    def remove(self, name: str) -> None:
        """Have a surface no more; harmless where there is none."""
        with self._lock:
            self._surfaces.pop(name, None)

    def names(self) -> tuple[str, ...]:
        """Return the names of all surfaces."""
        with self._lock:
            return tuple(self._surfaces)

    def surfaces(self) -> tuple[MeshedSurface, ...]:
        """Return all surfaces."""
        with self._lock:
            return tuple(self._surfaces.values())

    def put_box(self, name: str, centre_m: Array, *, size_m: Array) -> None:
        """Have a box as a surface of its own, in the room."""
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        self.put(name, centre_m + 0.5 * signs * size_m, triangles=BOX_TRIANGLES)


BOX_TRIANGLES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip
"""Faces of a box whose corners count in x, then y, then z, seen from outside."""


def numbers_at(surface: MeshedSurface, triangles_per_m3: float) -> MeshNumbers:
    """Return a surface's mesh, no finer than was asked for, wound as the headset does."""
    vertices, triangles = surface.vertices_m, surface.triangles
    size = np.ptp(vertices, axis=0) if len(vertices) else np.zeros(3)
    volume = float(np.prod(np.maximum(size, 0.5)))
    most = max(12.0, triangles_per_m3 * volume) if np.isfinite(triangles_per_m3) else np.inf
    grid_m = MIN_GRID_M
    for _ in range(MAX_GRIDS):
        if len(triangles) <= most:
            break
        vertices, triangles = gathered(surface.vertices_m, surface.triangles, grid_m=grid_m)
        grid_m *= GROWTH
    normals = _normals(vertices, triangles)
    return MeshNumbers(vertices, triangles[:, ::-1].astype(np.int32), normals)


def gathered(
    vertices: Array, triangles: NDArray[np.int64], *, grid_m: float
) -> tuple[Array, NDArray[np.int64]]:
    """Return a mesh whose vertices within a cell of a grid are one, in their middle."""
    cells = np.floor(vertices / grid_m).astype(np.int64)
    _, which, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    which = which.ravel()
    middle = np.zeros((len(counts), 3))
    np.add.at(middle, which, vertices)
    middle /= counts[:, None]
    moved = which[triangles]
    a, b, c = moved.T
    kept = moved[(a != b) & (b != c) & (c != a)]
    # What folded onto itself is there once.
    _, first = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    return middle, kept[np.sort(first)]


def _normals(vertices: Array, triangles: NDArray[np.int64]) -> Array:
    normals = np.zeros_like(vertices)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    for k in range(3):
        np.add.at(normals, triangles[:, k], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def _pieces(room: PhysicalRoom) -> dict[str, tuple[Array, NDArray[np.int64]]]:
    """The room's static meshes, cut into cells; each with vertices of its own."""
    parts = [_cut_up(mesh) for mesh in room.static]
    if room.collision is not None:
        faces = room.collision.faces.astype(np.int64)
        parts.append((room.collision.vertices.astype(np.float64), faces))
    pieces: dict[str, tuple[Array, NDArray[np.int64]]] = {}
    for number, (vertices, triangles) in enumerate(parts):
        cells = np.floor(vertices[triangles].mean(axis=1) / CELL_M).astype(np.int64)
        for cell in np.unique(cells, axis=0):
            inside = triangles[(cells == cell).all(axis=1)]
            used, renumbered = np.unique(inside, return_inverse=True)
            name = f"{number}:" + ",".join(map(str, cell.tolist()))
            pieces[name] = (vertices[used], renumbered.reshape(-1, 3))
    return pieces


def _cut_up(mesh: TexturedMesh) -> tuple[Array, NDArray[np.int64]]:
    """A mesh with short edges, gathered to what a headset resolves."""
    fine = refine_mesh(mesh, max_edge_m=EDGE_M)
    return gathered(fine.vertices, fine.faces, grid_m=MIN_GRID_M)
