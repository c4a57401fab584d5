"""Shapes as strokes over a picture, for machines without OpenGL: a bounded number of edges."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from studio.app.model.documents.added_mesh import Geometry
from studio.app.viewport.drawing.shapes import Line, Shape, Skin, Solid, Squares, Surface, Wire

Edges = NDArray[np.float64]
"""(N, 2, 3): both ends of each, metres."""

MAX_EDGES = 16_000
"""Of one mesh; of more, an even choice is drawn. A mesh of 16 000 takes 13 ms of a picture of
960 × 540, a scanned room's with bodies 31 ms (2 cores, other work beside it); 6000 take half as
long, and on a scanned room's walls are too few to be read as a surface."""

MAX_KEPT = 16
"""Meshes whose edges are kept, 0.26 MB each: more than a room usually has."""

PIECE_M, MAX_PIECES = 0.25, 24
"""Edges are parted into pieces about so long, metres, and so many at most: each is hidden alone."""

NEAR_M = 0.05
"""Near plane, metres: as with OpenGL."""

BEHIND_M = 0.05
"""How far behind the room's splats an edge still shows, metres: a collision mesh lies in them, off
by the error of a scan's surface."""

CORNERS = 24
"""Around a ball, cylinder or cone."""

SUBPIXEL_BITS = 4
"""Of the coordinates that OpenCV draws between."""


class Outlines:
    """Draws shapes as strokes, and keeps the edges of meshes that it has seen."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: dict[int, tuple[CollisionMesh | Geometry, NDArray[np.int64]]] = {}

    def draw(
        self,
        picture: NDArray[np.uint8],
        depth: NDArray[np.float32],
        shapes: Sequence[Shape],
        camera: Pinhole,
        world_from_camera: Pose,
    ) -> None:
        """Draw what is not behind the room.

        Args:
            picture: (H, W, 3) RGB, drawn on.
            depth: (H, W) metres along z, 0 where nothing is.
            shapes: to draw.
            camera: of that size.
            world_from_camera: its pose.
        """
        camera_from_world = world_from_camera.inverse()
        for shape in shapes:
            for edges, colour in self._strokes(shape):
                flat = camera_from_world @ edges.reshape(-1, 3)
                ends = _parted(_before_camera(flat.reshape(-1, 2, 3)))
                width = round(shape.width_px) if isinstance(shape, Line) else 1
                _draw(picture, depth, ends, camera=camera, colour=colour, width_px=width)

    def _strokes(self, shape: Shape) -> list[tuple[Edges, NDArray[np.float64]]]:
        """Edges in the world, and their colour, 0..1."""
        match shape:
            case Solid():
                edges = solid_edges(shape)
            case Line():
                edges = line_edges(shape.points)
            case Wire():
                edges = shape.mesh.vertices[self._of(shape.mesh, shape.mesh.faces)]
            case Surface():
                mesh = shape.geometry
                ends = mesh.vertices[self._of(mesh, mesh.faces)].astype(np.float64)
                ends *= shape.scale
                world = (shape.world_from_body @ ends.reshape(-1, 3)).reshape(-1, 2, 3)
                return [(world, surface_colour(mesh))]
            case Skin():
                return []  # people are drawn by `studio.view.overlay` where there is no OpenGL
            case Squares():
                corners = shape.corners[:MAX_EDGES]
                sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)
                return list(zip(sides, shape.colours, strict=False))
        return [(edges.astype(np.float64), np.asarray(shape.colour, dtype=np.float64))]

    def _of(self, mesh: CollisionMesh | Geometry, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        with self._lock:  # views draw on threads of their own
            found = self._kept.get(id(mesh))  # what is kept stays alive: its id is nobody else's
            if found is None:
                while len(self._kept) >= MAX_KEPT:
                    del self._kept[next(iter(self._kept))]
                found = self._kept[id(mesh)] = (mesh, mesh_edges(faces))
            return found[1]


def mesh_edges(faces: NDArray[np.integer], most: int = MAX_EDGES) -> NDArray[np.int64]:
    """(N, 2) numbers of vertices: each edge of triangles (F, 3) once, `most` at most."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = np.sort(sides.astype(np.int64), axis=1).T
    wide = int(high.max(initial=0)) + 1
    edges = np.stack(np.divmod(np.unique(low * wide + high), wide), axis=1)
    if len(edges) <= most:
        return edges
    return edges[np.linspace(0, len(edges) - 1, most).astype(np.int64)]


def line_edges(points: NDArray[np.float64]) -> Edges:
    """Edges of a polyline; none at its gaps of NaN."""
    edges = np.stack([points[:-1], points[1:]], axis=1)
    return edges[np.isfinite(edges).all(axis=(1, 2))]


def solid_edges(solid: Solid) -> Edges:
    """Edges in the world of a box, three circles of a ball, rims and sides of the others."""
    turn = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    c, s, o = np.cos(turn), np.sin(turn), np.zeros(CORNERS + 1)
    lines: list[NDArray[np.float64]]
    match solid.form:
        case "ball":
            lines = [np.stack(axes, axis=1) for axes in ((c, s, o), (o, c, s), (s, o, c))]
        case "cylinder":
            lines = [np.stack([c, s, o + z], axis=1) for z in (-1.0, 1.0)]
            lines += [np.stack([a, b]) for a, b in zip(lines[0][::6], lines[1][::6], strict=True)]
        case "cone":
            rim = np.stack([o - 1.0, c, s], axis=1)
            lines = [rim, *(np.array([corner, [1.0, 0.0, 0.0]]) for corner in rim[::6])]
        case "box":
            square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=np.float64)
            lines = [np.insert(square, 2, z, axis=1) for z in (-1.0, 1.0)]
            lines += [np.stack([a, b]) for a, b in zip(*lines, strict=True)]
    edges = np.concatenate([line_edges(line) for line in lines]) * 0.5 * np.asarray(solid.size_m)
    return (solid.world_from_body @ edges.reshape(-1, 3)).reshape(-1, 2, 3)


def surface_colour(geometry: Geometry) -> NDArray[np.float64]:
    """One colour for the edges of a mesh, 0..1: its mean."""
    colours = np.asarray(geometry.colours, dtype=np.float64).reshape(-1, 3)
    scale = 255.0 if np.issubdtype(geometry.colours.dtype, np.integer) else 1.0
    return colours.mean(axis=0) / scale


def _before_camera(ends: Edges) -> Edges:
    """Edges in a camera's frame, cut off where they come too near; those behind it are left out."""
    z = ends[:, :, 2]
    kept = ends[(z > NEAR_M).any(axis=1)].copy()
    a, b = kept[:, 0].copy(), kept[:, 1].copy()
    for near, far, at in ((a, b, 0), (b, a, 1)):
        cut = near[:, 2] < NEAR_M
        share = (NEAR_M - near[cut, 2]) / (far[cut, 2] - near[cut, 2])
        kept[cut, at] = near[cut] + share[:, None] * (far[cut] - near[cut])
    return kept


def _parted(ends: Edges) -> Edges:
    """Edges in pieces, each short enough to be hidden alone."""
    length_m = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    count = np.clip(np.ceil(length_m / PIECE_M), 1, MAX_PIECES).astype(np.int64)
    of = np.repeat(np.arange(len(ends)), count)
    place = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    share = np.stack([place, place + 1], axis=1) / count[of][:, None]
    return ends[of, :1] + share[:, :, None] * (ends[of, 1:] - ends[of, :1])


def _draw(
    picture: NDArray[np.uint8],
    depth: NDArray[np.float32],
    ends: Edges,
    *,
    camera: Pinhole,
    colour: NDArray[np.float64],
    width_px: int,
) -> None:
    """Pieces in the camera's frame, (N, 2, 3), those that the room does not hide."""
    height, width = depth.shape
    centre = np.array([camera.cx, camera.cy])
    focal = np.array([camera.fx, camera.fy])
    middle = ends.mean(axis=1)
    x, y = np.floor(middle[:, :2] / middle[:, 2:] * focal + centre).astype(np.int64).T
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    room_m = np.zeros(len(ends))
    room_m[inside] = depth[y[inside], x[inside]]
    shown = (room_m <= 0.0) | (middle[:, 2] < room_m + BEHIND_M)
    pixels = ends[shown, :, :2] / ends[shown, :, 2:] * focal + centre
    # One that leaves the picture by far is not seen, or its middle would be inside.
    near = (np.abs(pixels) < 4 * max(width, height)).all(axis=(1, 2))
    corners = np.round((pixels[near] - 0.5) * (1 << SUBPIXEL_BITS)).astype(np.int32)
    r, g, b = (round(255 * float(value)) for value in colour)
    cv2.polylines(picture, list(corners), False, (r, g, b), width_px, cv2.LINE_AA, SUBPIXEL_BITS)
