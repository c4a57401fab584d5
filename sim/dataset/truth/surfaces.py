"""The triangles of objects and rooms, as the truth is computed from and as files hold them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.atomic import write_file
from scenes.mesh import BoxPart, PhysicalObject, PhysicalRoom, TexturedMesh
from sim.bodies import UNIT_BOX_CORNERS

MILLIMETRES = 1000.0
"""BOP's models are in millimetres."""

BOX_FACES = np.array(
    [
        face
        for a, b, c, d in (
            (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3),
        )
        for face in ((a, b, c), (a, c, d))
    ],
    dtype=np.int32,
)  # fmt: skip
"""(12, 3) triangles of `UNIT_BOX_CORNERS`, counter-clockwise seen from outside."""

BARE = np.full((2, 2, 3), 160, dtype=np.uint8)
"""Texture of what has none: a mid grey."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles with a colour per vertex.

    Attributes:
        vertices: (V, 3) float64, metres.
        faces: (F, 3) int32.
        colours: (V, 3) uint8 sRGB.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    colours: NDArray[np.uint8]


def meshes_of_object(item: PhysicalObject) -> tuple[TexturedMesh, ...]:
    """An object's meshes in its own frame; its solid boxes where it has no meshes."""
    return item.meshes or tuple(_mesh_of_box(part) for part in item.parts)


def meshes_of_room(room: PhysicalRoom) -> tuple[TexturedMesh, ...]:
    """Static meshes of a room, or the collision mesh of a scanned one."""
    if room.static or room.collision is None:
        return room.static
    vertices = room.collision.vertices.astype(np.float64)
    uv = np.zeros((len(vertices), 2), np.float32)
    return (TexturedMesh(vertices, room.collision.faces, uv, BARE),)


def joined(meshes: Sequence[TexturedMesh]) -> Surface:
    """One surface of several meshes; a vertex has the colour of the texture where it lies."""
    if not meshes:
        return Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros((0, 3), np.uint8))
    before = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, before, strict=False)]
    return Surface(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(faces).astype(np.int32),
        np.concatenate([_vertex_colours(mesh) for mesh in meshes]),
    )


def write_obj(path: Path, surface: Surface) -> None:
    """A Wavefront file in metres, with `v x y z r g b` as many readers know it.

    Raises:
        WriteError: it cannot be written.
    """
    lines = ["# metres, Z up, right-handed"]
    shades = surface.colours / 255.0
    for (x, y, z), (r, g, b) in zip(surface.vertices, shades, strict=True):
        lines.append(f"v {x:.6f} {y:.6f} {z:.6f} {r:.3f} {g:.3f} {b:.3f}")
    lines += [f"f {a} {b} {c}" for a, b, c in surface.faces + 1]
    write_file(path, [("\n".join(lines) + "\n").encode("ascii")])


def write_model_ply(path: Path, surface: Surface) -> None:
    """A PLY file in millimetres with colours, as BOP's models are.

    Raises:
        WriteError: it cannot be written.
    """
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(surface.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        f"element face {len(surface.faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    vertices = np.empty(len(surface.vertices), np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)]))
    vertices["xyz"], vertices["rgb"] = MILLIMETRES * surface.vertices, surface.colours
    faces = np.empty(len(surface.faces), np.dtype([("n", "u1"), ("v", "<i4", 3)]))
    faces["n"], faces["v"] = 3, surface.faces
    write_file(path, [header.encode("ascii"), vertices.tobytes(), faces.tobytes()])


def read_obj(path: Path) -> NDArray[np.float64]:
    """(F, 3, 3) triangle corners of a Wavefront file, in the file's unit.

    Raises:
        ValueError: it has no triangle, or a line cannot be read; names file and line.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                vertices.append([float(word) for word in words[1:4]])
            elif words[:1] == ["f"]:
                corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
                faces += [[corners[0], *pair] for pair in pairwise(corners[1:])]
        except ValueError:
            raise ValueError(f"{path}: line {number}: {line!r}, wanted numbers") from None
    if not faces or min(map(min, faces)) < 0 or max(map(max, faces)) >= len(vertices):
        raise ValueError(f"{path}: {len(faces)} triangles over {len(vertices)} vertices: no mesh")
    return np.array(vertices)[np.array(faces)]


def read_model_ply(path: Path) -> NDArray[np.float64]:
    """(F, 3, 3) triangle corners of a file of `write_model_ply`, in millimetres.

    Raises:
        ValueError: it is no such file.
    """
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in head.splitlines() if line.startswith(b"element")]
    vertex, face = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)]), np.dtype("u1, (3,)<i4")
    if len(counts) != 2 or len(body) != counts[0] * vertex.itemsize + counts[1] * face.itemsize:
        raise ValueError(f"{path}: no model as written here; write the data set again")
    vertices = np.frombuffer(body, vertex, counts[0])["xyz"].astype(np.float64)
    faces = np.frombuffer(body, face, counts[1], counts[0] * vertex.itemsize)["f1"]
    return vertices[faces]


def _mesh_of_box(part: BoxPart) -> TexturedMesh:
    corners = part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m))
    return TexturedMesh(corners, BOX_FACES, np.zeros((8, 2), np.float32), BARE)


def _vertex_colours(mesh: TexturedMesh) -> NDArray[np.uint8]:
    height, width = mesh.texture.shape[:2]
    columns = np.clip(np.floor(mesh.uv[:, 0] % 1.0 * width).astype(int), 0, width - 1)
    rows = np.clip(np.floor((1.0 - mesh.uv[:, 1]) % 1.0 * height).astype(int), 0, height - 1)
    return mesh.texture[rows, columns]
