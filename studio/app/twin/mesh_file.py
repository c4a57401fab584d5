"""Mesh files as bodies to put into the twin: read, held to limits, set upright on their base."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from devices.streams import Slot
from scenes.frames import WORLD_FROM_GLTF
from scenes.workers.task import Task
from studio.app.model.documents.added_mesh import MAX_TRIANGLES, METRES, Axis, Geometry
from studio.app.twin.edits import EditError

SUFFIXES = (".obj", ".ply", ".glb", ".gltf", ".stl", ".off")
MAX_BYTES = 64_000_000
"""Of a file: a text of `MAX_TRIANGLES` triangles with normals and texture places is half of it."""

MIN_M, MAX_M = 0.01, 20.0
"""Longest side of a mesh, metres: what is smaller or larger is in another unit, or fits no room."""

Up = Literal["", "y", "z"]
Y_UP = (".glb", ".gltf", ".obj")
"""Formats that have Y up by their rules (glTF) or by what most modellers write (OBJ)."""


class OtherUnitError(EditError):
    """A mesh is of no size that fits a room if its unit is the one that was taken.

    Attributes:
        fitting: size of its longest side in each unit that would fit, metres.
    """

    def __init__(self, text: str, fitting: dict[str, float]) -> None:
        super().__init__(text)
        self.fitting = fitting

    @property
    def likely(self) -> str:
        """The unit that is taken without a question; "" if none would fit.

        Programs that do not model in metres save millimetres or centimetres: the one of both in
        which the mesh is nearest to a metre.
        """
        metric = {name: side for name, side in self.fitting.items() if name in ("cm", "mm")}
        known = metric or self.fitting
        return min(known, key=lambda name: abs(math.log(known[name])), default="")


def read_geometry(path: Path, *, unit: str = "m", up: Up = "", fallback: Any) -> Geometry:
    """The triangles of a file, in metres, Z up, standing on z = 0 around x = y = 0.

    Args:
        path: .obj, .ply, .glb, .gltf, .stl or .off.
        unit: of its lengths, a key of `METRES`.
        up: which of its axes is up; "" for the format's usual one.
        fallback: colour (3,) 0..1 of a file that has none.

    Raises:
        EditError: it cannot be read, or has no triangles or too many.
        OtherUnitError: it is of a size that says that its unit is another one.
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
    if len(faces) > MAX_TRIANGLES:
        raise EditError(
            f"{path.name}: {len(faces)} triangles, limit {MAX_TRIANGLES}; reduce it in a "
            "modelling program (decimate), then add it again"
        )
    if not np.isfinite(vertices).all():
        raise EditError(f"{path.name}: a vertex is not finite; repair it in a modelling program")
    if upper_axis(path, up) == "y":
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
    """Describe what was added, and what the file did not say, in one sentence."""
    x, y, z = geometry.size_m
    is_gltf = path.suffix.lower() in (".glb", ".gltf")
    text = f"{path.name}: {len(geometry.faces)} triangles, {x:.3f} × {y:.3f} × {z:.3f} m"
    if is_gltf or (unit != "m" and up):
        return text
    return (
        f"{text}, read in {unit} with {upper_axis(path, up)} up, since the file does not say; if "
        "that is wrong, choose another unit or axis in the dock Twin"
    )


def upper_axis(path: Path, up: Up) -> Axis:
    """Upper axis of a file: the one that is given, else the format's usual one."""
    return up or ("y" if path.suffix.lower() in Y_UP else "z")


def _surface(path: Path) -> Any:
    if not path.is_file():
        raise EditError(f"{path}: there is no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise EditError(f"{path.name}: wanted a mesh: {' '.join(SUFFIXES)}")
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise EditError(
            f"{path.name}: {size / 1e6:.0f} MB, limit {MAX_BYTES / 1e6:.0f} MB; reduce it in a "
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
    if MIN_M <= METRES[unit] * longest <= MAX_M:
        return
    fitting = {
        name: factor * longest
        for name, factor in METRES.items()
        if MIN_M <= factor * longest <= MAX_M
    }
    words = [f"unit={name} ({_sides(METRES[name] * sides)})" for name in fitting]
    remedy = f"add it with {' or '.join(words)}" if words else "scale it in a modelling program"
    raise OtherUnitError(
        f"{path.name}: {_sides(METRES[unit] * sides)} if its unit is {unit}, limits of the longest "
        f"side {MIN_M:g} to {MAX_M:g} m; {remedy}",
        fitting,
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


@dataclass(frozen=True, slots=True, eq=False)
class ReadMesh:
    """A mesh that was read, or why it was not.

    Attributes:
        path: of the file.
        place: (3,) where it is to stand, world metres.
        yaw_rad: heading.
        geometry: its triangles, or None.
        unit, up: that its lengths were taken to be in, and its upper axis.
        text: what there is to say of it.
    """

    path: Path
    place: Any
    yaw_rad: float
    geometry: Geometry | None
    text: str
    unit: str = "m"
    up: Axis = "z"


class MeshJob:
    """Reads one file.

    Args:
        path: of the file.
        place: (3,) where the mesh is to stand.
        yaw_rad: heading.
        unit: see `read_geometry`; "" for metres, or the likeliest unit of a mesh that would be too
            large for a room in metres.
        up: see `read_geometry`.
        fallback: colour (3,) 0..1 of a mesh without.
    """

    def __init__(
        self, path: Path, *, place: Any, yaw_rad: float, unit: str, up: Up, fallback: Any
    ) -> None:
        self.result: Slot[ReadMesh] = Slot()

        def run(_task: Task[None]) -> None:
            try:
                geometry, read_in = _read(path, unit=unit, up=up, fallback=fallback)
                text = described(path, geometry, unit=read_in, up=up)
            except (EditError, ValueError, OSError, MemoryError) as error:
                self.result.put(ReadMesh(path, place, yaw_rad, None, str(error)))
            else:
                axis = upper_axis(path, up)
                self.result.put(ReadMesh(path, place, yaw_rad, geometry, text, read_in, axis))

        Task("mesh file", run).start()


def _read(path: Path, *, unit: str, up: Up, fallback: Any) -> tuple[Geometry, str]:
    """The triangles, and the unit that they were taken to be in."""
    try:
        return read_geometry(path, unit=unit or "m", up=up, fallback=fallback), unit or "m"
    except OtherUnitError as error:
        if unit or not error.likely:
            raise
        return read_geometry(path, unit=error.likely, up=up, fallback=fallback), error.likely
