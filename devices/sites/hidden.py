"""Surfaces of a room that hide what is behind them, as entries of a log: an item a cell."""

from __future__ import annotations

from devices.hub.protocol.mesh import Cell, MeshError, unpack_cell
from devices.sites.channels import SiteBytesError
from devices.transport.followed import LogNews
from scenes.mesh import CollisionMesh

MAX_CELL_NAME = 20
"""Characters of a cell's name: three numbers of 16 bits with their signs, and blanks between."""


def cell_name(cell: Cell) -> str:
    """Return the name of a cell's item."""
    return " ".join(str(number) for number in cell)


def read_cells(news: LogNews) -> tuple[dict[Cell, CollisionMesh], int]:
    """Return cells of a log's news, without triangles where one is gone, and how many were none.

    Args:
        news: entries as they came, newest last.
    """
    found: dict[Cell, CollisionMesh] = {}
    refused = 0
    for entry in news.entries:
        try:
            cell = _cell_of(entry.item)
            found[cell] = unpack_cell(cell, entry.data)
        except (SiteBytesError, MeshError):
            refused += 1
    return found, refused


def _cell_of(name: str) -> Cell:
    """Return the cell that a name says, if it is said as here.

    Raises:
        SiteBytesError: it is none.
    """
    try:
        i, j, k = (int(part) for part in name[: MAX_CELL_NAME + 1].split(" "))
    except ValueError:
        raise SiteBytesError(f"hidden: {name[:40]!r} names no cell") from None
    if cell_name((i, j, k)) != name:
        raise SiteBytesError(f"hidden: {name[:40]!r} names no cell")
    return i, j, k
