"""Surfaces that the headset alone sees, handed to a hub: they hide what is behind them."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Protocol

from scenes.mesh import CollisionMesh
from sim.physics.collision.surface import Cell


class Hiding(Protocol):
    """Part of a hub that lets surfaces hide what is behind them."""

    def hide_behind(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Let surfaces hide what is behind them for everybody."""
        ...


class HiddenSurfaces:
    """Cells that hide what is behind them; each hub gets all once, and then what changes."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cells: dict[Cell, CollisionMesh] = {}
        self._changed: dict[Cell, CollisionMesh] = {}
        self._shown_to: Hiding | None = None

    def change(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Take cells that have changed; one without triangles is gone. On any thread."""
        with self._lock:
            for cell, mesh in cells.items():
                self._changed[cell] = mesh
                if len(mesh.faces):
                    self._cells[cell] = mesh
                else:
                    self._cells.pop(cell, None)

    def show(self, hub: Hiding) -> None:
        """Hand a hub what it does not have yet; nothing where there is nothing new."""
        with self._lock:
            is_new = hub is not self._shown_to
            cells = dict(self._cells) if is_new else self._changed
            self._shown_to, self._changed = hub, {}
        if cells:
            hub.hide_behind(cells)
