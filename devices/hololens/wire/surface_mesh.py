"""Mesh of one surface: how it is asked for, how it comes, and its numbers in both formats."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.taking import Take, WireError, checked_count, taken

MESH_REQUEST = struct.Struct("<16sd4I")
"""A request: id, most triangles a cubic metre, formats of vertices, indices and normals, 0."""

MESH_HEADER = struct.Struct("<5I3f16f10f")
"""Before a mesh, 136 bytes: index, status, bytes of vertices, indices and normals, scale, pose for
row vectors, bounds as centre, extents and quaternion."""

MAX_PART_BYTES = 1 << 24
"""Largest part of a mesh, bytes: a million vertices of 16 bytes."""

FULL_INT16, FULL_INT8 = 32767, 127
"""Integers that mean 1."""

FLOAT_VERTICES, SHORT_VERTICES = 2, 13
"""Formats of vertices: four float32, or four int16 that mean -1..1."""

SHORT_INDICES, LONG_INDICES = 57, 42
"""Formats of indices: uint16, or uint32."""

FLOAT_NORMALS, BYTE_NORMALS = 2, 31
"""Formats of normals: four float32, or four int8 that mean -1..1."""

_VERTEX_TYPES = {FLOAT_VERTICES: "<f4", SHORT_VERTICES: "<i2"}
"""Types of the numbers of a vertex, by format."""

_INDEX_TYPES = {SHORT_INDICES: "<u2", LONG_INDICES: "<u4"}
"""Types of an index, by format."""

_NORMAL_TYPES = {FLOAT_NORMALS: "<f4", BYTE_NORMALS: "i1"}
"""Types of the numbers of a normal, by format."""


class MeshStatus(IntEnum):
    """Outcome of a request."""

    OK = 0
    UNKNOWN_ID = 1
    FAILED = 2


@dataclass(frozen=True, slots=True)
class MeshRequest:
    """Request for one mesh.

    Attributes:
        guid: 16 bytes.
        triangles_per_m3: at most.
        vertex_format: `FLOAT_VERTICES` or `SHORT_VERTICES`.
        index_format: `SHORT_INDICES` or `LONG_INDICES`.
        normal_format: `FLOAT_NORMALS` or `BYTE_NORMALS`.
    """

    guid: bytes
    triangles_per_m3: float = 1000.0
    vertex_format: int = SHORT_VERTICES
    index_format: int = LONG_INDICES
    normal_format: int = BYTE_NORMALS


def _identity() -> NDArray[np.float32]:
    return np.eye(4, dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class MeshReply:
    """One mesh as it travels.

    Attributes:
        index: which of the requests it answers, from 0.
        status: nothing but it is there where it is not `OK`.
        vertices: bytes.
        indices: bytes.
        normals: bytes.
        scale: (3,) factors on the vertices.
        pose: (4, 4) float32 for row vectors.
        bounds: (10,) oriented box.
    """

    index: int
    status: MeshStatus
    vertices: bytes = b""
    indices: bytes = b""
    normals: bytes = b""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    pose: NDArray[np.float32] = field(default_factory=_identity)
    bounds: tuple[float, ...] = (0.0,) * 9 + (1.0,)


def encode_mesh_request(request: MeshRequest) -> bytes:
    """Return a request's 40 bytes."""
    formats = (request.vertex_format, request.index_format, request.normal_format)
    return MESH_REQUEST.pack(request.guid, request.triangles_per_m3, *formats, 0)


def read_mesh_request(take: Take) -> MeshRequest:
    """Read a request.

    Raises:
        WireError: a format is none of the two.
    """
    guid, density, vertex, index, normal, _zero = taken(take, MESH_REQUEST)
    known = (("vertices", vertex, _VERTEX_TYPES), ("indices", index, _INDEX_TYPES))
    for name, value, types in (*known, ("normals", normal, _NORMAL_TYPES)):
        if value not in types:
            raise WireError(f"mesh: format {value} of {name}, wanted one of {list(types)}")
    return MeshRequest(guid, density, vertex, index, normal)


def encode_mesh(reply: MeshReply) -> bytes:
    """Return a mesh's header and, where its status is `OK`, its body."""
    is_ok = reply.status is MeshStatus.OK
    body = (reply.vertices, reply.indices, reply.normals) if is_ok else ()
    sizes = [len(part) for part in body] or [0, 0, 0]
    pose = [float(value) for value in np.asarray(reply.pose).ravel()]
    header = (reply.index, int(reply.status), *sizes, *reply.scale, *pose, *reply.bounds)
    return MESH_HEADER.pack(*header) + b"".join(body)


def read_mesh(take: Take) -> MeshReply:
    """Read a mesh.

    Raises:
        WireError: the status is none, or a part is larger than `MAX_PART_BYTES`.
    """
    values = taken(take, MESH_HEADER)
    try:
        status = MeshStatus(values[1])
    except ValueError:
        raise WireError(f"mesh: status {values[1]}, wanted 0..2") from None
    sizes = [
        checked_count("mesh: bytes of a part", size, most=MAX_PART_BYTES) for size in values[2:5]
    ]
    parts = [take(size) for size in sizes] if status is MeshStatus.OK else [b""] * 3
    pose = np.array(values[8:24], np.float32).reshape(4, 4)
    vertices, indices, normals = parts
    return MeshReply(
        values[0], status, vertices, indices, normals, values[5:8], pose, values[24:34]
    )


@dataclass(frozen=True, slots=True, eq=False)
class MeshNumbers:
    """A mesh's numbers, in the surface's own axes.

    Attributes:
        vertices_m: (V, 3) float64.
        triangles: (T, 3) int32, in the headset's order: clockwise seen from the free side.
        normals: (V, 3) float64.
    """

    vertices_m: NDArray[np.float64]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float64]


def numbers_of(reply: MeshReply, request: MeshRequest) -> MeshNumbers:
    """Return the numbers of a mesh that came as it was asked for.

    Raises:
        WireError: its parts have no whole number of elements, an index leads to no vertex, or a
            number is not finite.
    """
    vertices = _quadruples("vertices", reply.vertices, kind=_VERTEX_TYPES[request.vertex_format])
    normals = _quadruples("normals", reply.normals, kind=_NORMAL_TYPES[request.normal_format])
    size = np.dtype(_INDEX_TYPES[request.index_format]).itemsize
    if len(reply.indices) % (3 * size):
        raise WireError(f"mesh: {len(reply.indices)} bytes of indices, {size} each, no triangles")
    indices = np.frombuffer(reply.indices, _INDEX_TYPES[request.index_format])
    if len(indices) and int(indices.max()) >= len(vertices):
        raise WireError(f"mesh: index {int(indices.max())}, limit {len(vertices) - 1}")
    with np.errstate(all="ignore"):
        places = vertices[:, :3] * np.asarray(reply.scale) / vertices[:, 3:]
    if not np.isfinite(places).all() or not np.isfinite(normals).all():
        raise WireError("mesh: a vertex or normal is not finite")
    length = FULL_INT8 if request.normal_format == BYTE_NORMALS else 1.0
    triangles = indices.reshape(-1, 3).astype(np.int32)
    return MeshNumbers(places, triangles, normals[:, :3] / length)


def _quadruples(name: str, data: bytes, *, kind: str) -> NDArray[np.float64]:
    size = 4 * np.dtype(kind).itemsize
    if len(data) % size:
        raise WireError(f"mesh: {len(data)} bytes of {name}, wanted a multiple of {size}")
    return np.frombuffer(data, kind).reshape(-1, 4).astype(np.float64)


def reply_with(
    numbers: MeshNumbers, request: MeshRequest, *, index: int, pose: NDArray[Any]
) -> MeshReply:
    """Return a mesh in the formats that were asked for; `FAILED` where 16 bits do not count it.

    Args:
        numbers: of the mesh.
        request: with the formats.
        index: which of the requests it answers.
        pose: (4, 4) for row vectors.
    """
    count = len(numbers.vertices_m)
    if request.index_format == SHORT_INDICES and count > 0xFFFF:
        return MeshReply(index, MeshStatus.FAILED)
    scale = np.ones(3)
    vertices = np.ones((count, 4))
    vertices[:, :3] = numbers.vertices_m
    if request.vertex_format == SHORT_VERTICES:
        scale = np.maximum(np.abs(numbers.vertices_m).max(axis=0, initial=0.0), 1e-6)
        scale = scale.astype(np.float32).astype(np.float64)
        vertices[:, :3] /= scale
        vertices = np.clip(np.round(vertices * FULL_INT16), -FULL_INT16, FULL_INT16)
    normals = np.zeros((count, 4))
    normals[:, :3] = numbers.normals
    if request.normal_format == BYTE_NORMALS:
        normals = np.clip(np.round(normals * FULL_INT8), -FULL_INT8, FULL_INT8)
    low = numbers.vertices_m.min(axis=0, initial=np.inf) if count else np.zeros(3)
    high = numbers.vertices_m.max(axis=0, initial=-np.inf) if count else np.zeros(3)
    centre, extents = (low + high) / 2, high - low
    x, y, z = scale.tolist()
    return MeshReply(
        index,
        MeshStatus.OK,
        vertices.astype(_VERTEX_TYPES[request.vertex_format]).tobytes(),
        numbers.triangles.astype(_INDEX_TYPES[request.index_format]).tobytes(),
        normals.astype(_NORMAL_TYPES[request.normal_format]).tobytes(),
        (x, y, z),
        np.asarray(pose, np.float32),
        (*centre.tolist(), *extents.tolist(), 0.0, 0.0, 0.0, 1.0),
    )
