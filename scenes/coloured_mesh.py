"""Triangles with a colour at each corner, and how text files keep them."""

from __future__ import annotations

import base64
import binascii
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_TRIANGLES = 100_000
"""Of one added mesh, chosen for views without a graphics card: 197 000 took 0.25 s a picture and
1.4 MB of a project's file, measured on two cores beside other work."""


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """The triangles of a mesh in its own frame: Z up, origin below the middle, on the base.

    Attributes:
        vertices: (V, 3) float32, metres.
        faces: (F, 3) int32, counter-clockwise seen from outside.
        colours: (V, 3) uint8 sRGB.
        packed: all of it as text files have it, made once: base64 of a zlib stream.

    Raises:
        ValueError: a shape is wrong, a number not finite, an index out of range, or there are more
            than `MAX_TRIANGLES` triangles.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colours: NDArray[np.uint8]
    packed: str = ""

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float32)
        faces = np.array(self.faces, dtype=np.int32)
        colours = np.array(self.colours, dtype=np.uint8)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise ValueError(f"mesh vertices: shape {vertices.shape}, wanted finite (V, 3)")
        if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise ValueError(f"mesh faces: shape {faces.shape}, wanted (F, 3) with F above 0")
        if len(faces) > MAX_TRIANGLES:
            raise ValueError(f"mesh of {len(faces)} triangles, limit {MAX_TRIANGLES}")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise ValueError(
                f"mesh faces: index {faces.min()}..{faces.max()}, limits 0..{len(vertices) - 1}"
            )
        if colours.shape != vertices.shape:
            raise ValueError(f"mesh colours: shape {colours.shape}, wanted {vertices.shape}")
        packed = self.packed or _pack(vertices, faces, colours)
        for array in (vertices, faces, colours):
            array.setflags(write=False)
        for name, value in zip(
            ("vertices", "faces", "colours", "packed"),
            (vertices, faces, colours, packed),
            strict=True,
        ):
            object.__setattr__(self, name, value)

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Extents (x, y, z), metres."""
        x, y, z = (float(v) for v in np.ptp(self.vertices, axis=0))
        return x, y, z


def unpacked(text: str, *, vertex_count: int, face_count: int) -> Geometry:
    """Geometry of a text file.

    Raises:
        ValueError: it is damaged, or larger than a mesh can be.
    """
    if not 0 < face_count <= MAX_TRIANGLES or not 0 < vertex_count <= 3 * MAX_TRIANGLES:
        raise ValueError(
            f"mesh of {vertex_count} vertices and {face_count} triangles, limits "
            f"{3 * MAX_TRIANGLES} and {MAX_TRIANGLES}"
        )
    size = vertex_count * 15 + face_count * 12
    try:
        stream = zlib.decompressobj()
        raw = stream.decompress(base64.b64decode(text, validate=True), size + 1)
    except (zlib.error, binascii.Error, ValueError) as error:
        raise ValueError(f"mesh data cannot be read: {error}") from None
    if len(raw) != size:
        raise ValueError(f"mesh data of {len(raw)} bytes, wanted {size}")
    split = vertex_count * 12
    vertices = np.frombuffer(raw[:split], dtype="<f4").reshape(-1, 3)
    faces = np.frombuffer(raw[split : split + face_count * 12], dtype="<i4").reshape(-1, 3)
    colours = np.frombuffer(raw[split + face_count * 12 :], dtype=np.uint8).reshape(-1, 3)
    return Geometry(vertices, faces, colours, text)


def _pack(
    vertices: NDArray[np.float32], faces: NDArray[np.int32], colours: NDArray[np.uint8]
) -> str:
    raw = vertices.astype("<f4").tobytes() + faces.astype("<i4").tobytes() + colours.tobytes()
    return base64.b64encode(zlib.compress(raw, 6)).decode("ascii")
