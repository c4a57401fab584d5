"""Mesh files as bodies to put into the twin: read, held to limits, set upright on their base."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scenes.frames import WORLD_FROM_GLTF
from studio.app.model.documents.added_mesh import MOST_TRIANGLES, Geometry
from studio.app.twin.edits import EditError

SUFFIXES = (".obj", ".ply", ".glb", ".gltf", ".stl", ".off")
MOST_BYTES = 64_000_000
"""Of a file: a text of `MOST_TRIANGLES` triangles with normals and texture places is half of it."""

LEAST_M, LARGEST_M = 0.01, 20.0
"""Longest side of a mesh, metres: what is smaller or larger is in another unit, or fits no room."""

METRES: dict[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""One of each unit, metres."""

Up = Literal["", "y", "z"]
Y_UP = (".glb", ".gltf", ".obj")
"""Formats that have Y up by their rules (glTF) or by what most modellers write (OBJ)."""


def read_geometry(path: Path, *, unit: str = "m", up: Up = "", fallback: Any) -> Geometry:
    """The triangles of a file, in metres, Z up, standing on z = 0 around x = y = 0.

    Args:
        path: .obj, .ply, .glb, .gltf, .stl or .off.
        unit: of its lengths, a key of `METRES`.
        up: which of its axes is up; "" for the format's usual one.
        fallback: colour (3,) 0..1 of a file that has none.

    Raises:
        EditError: it cannot be read, has no triangles or too many, or is of a size that says that
            its unit is another one; the message says which would fit.
    """
    if unit not in METRES:
        raise EditError(f"twin.add_mesh: unit {unit!r}, wanted one of {', '.join(METRES)}")
    if up not in ("", "y", "z"):
        raise EditError(f"twin.add_mesh: up {up!r}, wanted y or z")
    surface = _surface(path)
    vertices = np.asarray(surface.vertices, dtype=np.float64)
    faces = np.asarray(surface.faces)
    if not len(faces) or not len(vertices):
        raise EditError(
            f"{path.name}: no triangles; export it as a surface, not as points or lines"
        )
    if len(faces) > MOST_TRIANGLES:
        raise EditError(
            f"{path.name}: {len(faces)} triangles, limit {MOST_TRIANGLES}; reduce it in a "
            "modelling program (decimate), then add it again"
        )
    if not np.isfinite(vertices).all():
        raise EditError(f"{path.name}: a vertex is not finite; repair it in a modelling program")
    if (up or ("y" if path.suffix.lower() in Y_UP else "z")) == "y":
        vertices = WORLD_FROM_GLTF @ vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    _check_size(path, high - low, unit)
    base = np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]])
    placed = METRES[unit] * (vertices - base)
    return Geometry(
        placed.astype(np.float32),
        faces.astype(np.int32),
        _colours(surface, fallback, len(vertices)),
    )


def described(path: Path, geometry: Geometry, *, unit: str, up: Up) -> str:
    """What was added, and what the file did not say, in one sentence."""
    x, y, z = geometry.size_m
    is_gltf = path.suffix.lower() in (".glb", ".gltf")
    text = f"{path.name}: {len(geometry.faces)} triangles, {x:.3f} × {y:.3f} × {z:.3f} m"
    if is_gltf or (unit != "m" and up):
        return text
    axis = up or ("y" if path.suffix.lower() in Y_UP else "z")
    return (
        f"{text}, read in {unit} with {axis} up, since the file does not say; if that is wrong, "
        "undo and add it with unit= and up="
    )


def _surface(path: Path) -> Any:
    if not path.is_file():
        raise EditError(f"{path}: there is no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise EditError(f"{path.name}: wanted a mesh: {' '.join(SUFFIXES)}")
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise EditError(
            f"{path.name}: {size / 1e6:.0f} MB, limit {MOST_BYTES / 1e6:.0f} MB; reduce it in a "
            "modelling program, or save it as .glb"
        )
    import trimesh

    try:
        return trimesh.load_mesh(path, process=False)
    # What trimesh raises on damaged files is not documented, and files are hostile.
    except Exception as error:  # noqa: BLE001
        raise EditError(
            f"{path.name}: is no mesh that can be read ({type(error).__name__}: {error}); export "
            "it again as .glb, .obj, .ply or .stl"
        ) from None


def _check_size(path: Path, sides: NDArray[np.float64], unit: str) -> None:
    longest = float(sides.max())
    if LEAST_M <= METRES[unit] * longest <= LARGEST_M:
        return
    fitting = [
        f"unit={name} ({_sides(factor * sides)})"
        for name, factor in METRES.items()
        if LEAST_M <= factor * longest <= LARGEST_M
    ]
    remedy = f"add it with {' or '.join(fitting)}" if fitting else "scale it in a modelling program"
    raise EditError(
        f"{path.name}: {_sides(METRES[unit] * sides)} if its unit is {unit}, limits of the longest "
        f"side {LEAST_M:g} to {LARGEST_M:g} m; {remedy}"
    )


def _sides(sides_m: NDArray[np.float64]) -> str:
    return " × ".join(f"{side:.3g}" for side in sides_m) + " m"


def _colours(surface: Any, fallback: Any, count: int) -> NDArray[np.uint8]:
    """(V, 3) of the file; of one without, or with pictures that are not there, the fallback."""
    plain = np.tile((255 * np.asarray(fallback, dtype=float)).astype(np.uint8), (count, 1))
    if not getattr(surface.visual, "defined", False):
        return plain
    try:
        visual = surface.visual
        found = visual.to_color() if hasattr(visual, "to_color") else visual
        colours = np.asarray(found.vertex_colors, dtype=np.uint8)
    except Exception:  # noqa: BLE001 - as above: a damaged picture costs the colours, not the mesh
        return plain
    return colours[:, :3].copy() if colours.shape[:1] == (count,) else plain
