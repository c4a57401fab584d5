"""A mesh file that is being read on a thread, so that the window goes on."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from devices.streams import Slot
from studio.app.model.documents.added_mesh import Geometry
from studio.app.twin.edits import EditError
from studio.app.twin.mesh_file import Up, described, read_geometry


@dataclass(frozen=True, slots=True, eq=False)
class ReadMesh:
    """A mesh that was read, or why it was not.

    Attributes:
        path: of the file.
        place: (3,) where it is to stand, world metres.
        yaw_rad: heading.
        geometry: its triangles, or None.
        text: what there is to say of it.
    """

    path: Path
    place: Any
    yaw_rad: float
    geometry: Geometry | None
    text: str


class MeshJob:
    """Reads one file.

    Args:
        path: of the file.
        place: (3,) where the mesh is to stand.
        yaw_rad: heading.
        unit, up: see `read_geometry`.
        fallback: colour (3,) 0..1 of a mesh without.
    """

    def __init__(
        self, path: Path, *, place: Any, yaw_rad: float, unit: str, up: Up, fallback: Any
    ) -> None:
        self.result: Slot[ReadMesh] = Slot()

        def run() -> None:
            try:
                geometry = read_geometry(path, unit=unit, up=up, fallback=fallback)
                text = described(path, geometry, unit=unit, up=up)
            except (EditError, ValueError, OSError, MemoryError) as error:
                self.result.put(ReadMesh(path, place, yaw_rad, None, str(error)))
            else:
                self.result.put(ReadMesh(path, place, yaw_rad, geometry, text))

        threading.Thread(target=run, name="mesh file", daemon=True).start()
