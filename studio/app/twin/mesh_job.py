"""A mesh file that is being read on a thread, so that the window goes on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from devices.streams import Slot
from scenes.workers.task import Task
from studio.app.model.documents.added_mesh import Axis, Geometry
from studio.app.twin.edits import EditError
from studio.app.twin.mesh_file import (
    OtherUnitError,
    Up,
    described,
    read_geometry,
    upper_axis,
)


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
