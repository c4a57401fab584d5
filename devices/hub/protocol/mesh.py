"""Surfaces that are not drawn, only hide what is behind them, by cell, as they are sent.

A headset meshes the room while the session runs. Cells of it that have changed reach everybody, and
whoever comes later gets those that are there. No socket here.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.hub.entities.drawn import GLTF_FROM_WORLD
from devices.hub.protocol.wire import VERSION
from scenes.frames import WORLD_FROM_GLTF
from scenes.mesh import CollisionMesh

Cell = tuple[int, int, int]

MESH_KIND = 7
"""Of a message with cells."""

MAX_CELLS = 10_000
"""Cells that are kept, those that were taken away among them; chosen: 600 m² in cells of 25 cm."""

MAX_CELL_TRIANGLES = 1000
"""Triangles of a cell; chosen: ten times those of a headset's finest mesh in 25 cm."""

MAX_TRIANGLES = 60_000
"""Triangles of all cells, chosen: half a megabyte."""

MAX_MESSAGE_BYTES = 24 * 1024
"""Cells of one message, unless one is larger: bodies are not to wait for longer behind it."""

STEP_M = 1e-4
"""Corners are sent in steps of 0.1 mm from the cell's first one: up to 3.2 m away."""

MAX_ROOM_M = 100.0
"""Farthest corner from the room's origin, as on the wire of bodies."""

_HEADER = struct.Struct("<BBH")
"""Version, kind, number of cells."""

_CELL = struct.Struct("<3hHH3f")
"""Cell, numbers of corners and triangles, first corner."""


class MeshError(ValueError):
    """A cell that cannot be sent; says why."""


@dataclass(slots=True)
class MeshChannel:
    """Newest content of each cell, packed once for all who get it.

    Attributes:
        counter: counts changes of cells.
        left_out: cells that were too many, too large or too far away to be sent.
    """

    counter: int = 0
    left_out: int = 0
    _cells: dict[Cell, tuple[int, int, bytes]] = field(
        default_factory=dict[Cell, "tuple[int, int, bytes]"]
    )
    _triangles: int = 0

    def take(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Take changed cells, world metres; one without triangles is gone."""
        for cell, mesh in cells.items():
            _, before, _ = self._cells.pop(cell, (0, 0, b""))
            self._triangles -= before
            try:
                data = pack_cell(cell, mesh)
            except MeshError:
                self.left_out += 1
                data, mesh = _gone(cell), None
            count = 0 if mesh is None else len(mesh.faces)
            if self._triangles + count > MAX_TRIANGLES:
                self.left_out += 1
                data, count = _gone(cell), 0
            self.counter += 1
            self._triangles += count
            self._cells[cell] = (self.counter, count, data)
        self._forget()

    def next_after(self, counter: int) -> tuple[int, bytes] | None:
        """Return the message with the oldest cells that are newer, and the number of its last one.

        Args:
            counter: of the newest cell that was sent; 0 for whoever has none.
        """
        found = self.cells_after(counter)
        return None if found is None else (found[0], _joined(list(found[1].values())))

    def cells_after(self, counter: int) -> tuple[int, dict[Cell, bytes]] | None:
        """Return the oldest cells that are newer, as they are packed, and the number of the last.

        Args:
            counter: of the newest cell that was sent; 0 for whoever has none.
        """
        if self.counter <= counter:
            return None
        chosen: dict[Cell, bytes] = {}
        size, last = _HEADER.size, counter
        for cell, (number, count, data) in self._cells.items():
            if number <= counter:
                continue
            if chosen and size + len(data) > MAX_MESSAGE_BYTES:
                return last, chosen
            last = number
            if count or counter:  # whoever has none need not be sent what is gone
                chosen[cell] = data
                size += len(data)
        return self.counter, chosen

    def has(self, cell: Cell) -> bool:
        """Return whether there are triangles in a cell."""
        return self._cells.get(cell, (0, 0, b""))[1] > 0

    def _forget(self) -> None:
        """Forget cells above the limit: those that are gone first, oldest first."""
        for is_gone in (True, False):
            above = len(self._cells) - MAX_CELLS
            old = [cell for cell, (_, count, _) in self._cells.items() if (count == 0) == is_gone]
            for cell in old[: max(0, above)]:
                self._triangles -= self._cells.pop(cell)[1]
                self.left_out += not is_gone


def pack_cell(cell: Cell, mesh: CollisionMesh) -> bytes:
    """Return a cell as it is sent, y up.

    Layout: `i16 × 3` of the cell, `u16` corners, `u16` triangles, `f32 × 3` first corner in metres,
    `i16 × 3` of each corner in steps of 0.1 mm from it, `u16 × 3` corners of each triangle.

    Raises:
        MeshError: it is too large or too far away.
    """
    if not len(mesh.faces):
        return _gone(cell)
    used = np.unique(mesh.faces)
    index: NDArray[np.int64] = np.searchsorted(used, mesh.faces)
    corners = GLTF_FROM_WORLD @ mesh.vertices[used].astype(np.float64)
    first = corners[0].astype(np.float32).astype(np.float64)
    steps = np.asarray(np.rint((corners - first) / STEP_M), dtype=np.float64)
    longest = float(np.abs(steps).max())
    if len(mesh.faces) > MAX_CELL_TRIANGLES or longest > np.iinfo(np.int16).max:
        raise MeshError(
            f"mesh, cell {cell}: {len(mesh.faces)} triangles (limit {MAX_CELL_TRIANGLES}) over "
            f"{longest * STEP_M:.1f} m (limit 3.2 m): mesh more coarsely"
        )
    if np.abs(corners).max() > MAX_ROOM_M or np.abs(cell).max() > np.iinfo(np.int16).max:
        raise MeshError(f"mesh, cell {cell}: farther than {MAX_ROOM_M:g} m from the room's origin")
    head = _CELL.pack(*cell, len(used), len(mesh.faces), *first.tolist())
    return head + steps.astype("<i2").tobytes() + index.astype("<u2").tobytes()


def unpack_cell(cell: Cell, data: bytes) -> CollisionMesh:
    """Return what `pack_cell` has packed, world metres; no triangles where there are no bytes.

    Raises:
        MeshError: it is none, another cell's, or larger or farther away than one may be.
    """
    if not data:
        return CollisionMesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    if len(data) < _CELL.size:
        raise MeshError(f"mesh, cell {cell}: {len(data)} bytes, wanted at least {_CELL.size}")
    i, j, k, corners, triangles, *first = _CELL.unpack_from(data)
    wanted = _CELL.size + 6 * (corners + triangles)
    if (i, j, k) != cell or len(data) != wanted or triangles > MAX_CELL_TRIANGLES:
        raise MeshError(
            f"mesh, cell {cell}: {len(data)} bytes of {triangles} triangles in cell {(i, j, k)}, "
            f"wanted {wanted} of at most {MAX_CELL_TRIANGLES}"
        )
    steps = np.frombuffer(data, "<i2", 3 * corners, _CELL.size).reshape(-1, 3)
    faces = np.frombuffer(data, "<u2", 3 * triangles, _CELL.size + 6 * corners).reshape(-1, 3)
    places = np.array(first) + steps * STEP_M
    # A corner may be a cell's width beyond what the first one may be.
    if not np.abs(places).max(initial=0.0) <= MAX_ROOM_M + STEP_M * np.iinfo(np.int16).max:
        raise MeshError(f"mesh, cell {cell}: farther than {MAX_ROOM_M:g} m from the room's origin")
    try:
        corners_in_world = (WORLD_FROM_GLTF @ places).astype(np.float32)
        return CollisionMesh(corners_in_world, faces.astype(np.int32))
    except ValueError as error:
        raise MeshError(f"mesh, cell {cell}: {error}") from None


def _gone(cell: Cell) -> bytes:
    i, j, k = (max(-32768, min(32767, number)) for number in cell)
    return _CELL.pack(i, j, k, 0, 0, 0.0, 0.0, 0.0)


def _joined(cells: list[bytes]) -> bytes:
    return _HEADER.pack(VERSION, MESH_KIND, len(cells)) + b"".join(cells)
