"""The headset's mesh into the room's physics, on a thread of its own, and to remote pages."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock
from devices.hololens.headset import SurfaceSubscription
from devices.hololens.values import SpatialSurface, SurfaceChange
from scenes.formats.mesh_glb import write_mesh
from scenes.mesh import CollisionMesh, PhysicalObject
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import SceneState
from scenes.workers.task import Task
from sim.physics.collision.surface import Cell
from sim.physics.scanned.meshed import (
    change_of,
    hidden_cells,
    hidden_mesh,
    meshed_beside,
    whole_mesh,
    with_surface,
)
from sim.physics.scanned.objects import scanned_object
from sim.physics.scanned.opening import twin_of_package
from sim.physics.scanned.twin import Twin
from studio.live.hololens.timing import Durations

STEP_NS = 20_000_000
"""Time that the physics is let run at once, ns."""

FOLLOW_NS = 40_000_000
"""Time within which tracked objects are where the tracker has them, ns: a camera's picture."""

WAIT_S, IDLE_S = 0.02, 0.15
"""Longest waits for a surface, seconds: while things move, and while all is at rest."""

SETTLE_NS = 4_000_000_000
"""Physics that runs after a change, ns: a box that falls from a table lies still by then. What is
at rest costs nothing to leave alone."""

JUMP_M = 0.005
"""Movement of a free object in one exchange of a surface that counts as a jump."""


@dataclass(frozen=True, slots=True)
class MeshStatus:
    """The headset's mesh in the room's physics.

    Attributes:
        surfaces: of the headset that were taken.
        cells: cells in which it sees more than the scan.
        triangles: of what it sees more.
        changes: exchanges of the physics' surface so far.
        largest_step_mm: largest movement of an object by an exchange alone.
        failure: why there is no physics; empty while there is.
    """

    surfaces: int = 0
    cells: int = 0
    triangles: int = 0
    changes: int = 0
    largest_step_mm: float = 0.0
    failure: str = ""


class Meshing:
    """Takes surfaces, and keeps a physics of the room that they stop things in.

    Args:
        surfaces: changes of the headset's mesh.
        scene: the room, with a collision mesh.
        world_from_device: returns where the headset's world is in the room; None while it is not
            known well enough.
        clock: session time.
        changed: takes what the headset alone sees in the cells in which that has changed.
    """

    def __init__(
        self,
        surfaces: SurfaceSubscription,
        scene: ScenePackage,
        *,
        world_from_device: Callable[[], Pose | None],
        clock: Clock,
        changed: Callable[[Mapping[Cell, CollisionMesh]], None] = lambda _cells: None,
    ) -> None:
        self._surfaces, self._scene, self._clock = surfaces, scene, clock
        self._world_from_device, self._changed = world_from_device, changed
        self.updates = Durations()
        """Milliseconds from a surface's arrival to its collisions and occlusion; not of those that
        wait for the origin, all at once."""
        self._is_caught_up = False
        self._state = SceneState()
        self._task = Task("headset mesh", self._run)
        self._status = MeshStatus()
        self._seen: set[str] = set()
        self._twin: Twin | None = None
        self._movables: dict[str, PhysicalObject] = {}
        self._settled_ns = 0

    def start(self) -> None:
        """Begin; the physics is made on the thread."""
        self._task.start()

    def close(self) -> None:
        """End the thread."""
        self._task.cancel()
        self._task.join(2.0)
        self._surfaces.close()

    def publish(self, state: SceneState) -> None:
        """Let tracked objects be where a new state has them; returns at once."""
        self._state = state

    def status(self) -> MeshStatus:
        """Return how it is doing."""
        return self._status

    @property
    def hidden(self) -> CollisionMesh:
        """Mesh that the headset alone sees: it hides what is behind it, and is not seen itself."""
        twin = self._twin
        if twin is None:
            return CollisionMesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
        return hidden_mesh(self._meshed, twin.surface)

    def whole(self) -> CollisionMesh | None:
        """Return the scan's mesh with what the headset has added; None without physics."""
        scanned, twin = self._scene.collision, self._twin
        if scanned is None or twin is None:
            return None
        return whole_mesh(self._meshed, twin.surface, scanned=scanned)

    def save(self, path: Path) -> bool:
        """Write that mesh as glTF; return whether there was anything to be added."""
        whole = self.whole()
        if whole is None or not self._meshed.own:
            return False
        write_mesh(path, whole)
        return True

    def begin(self) -> None:
        """Make the physics of the room as it was scanned.

        Raises:
            ValueError: the room has no collision mesh.
        """
        self._movables = {item.object_id: scanned_object(item) for item in self._scene.objects}
        self._twin = twin = twin_of_package(self._scene, tracked=tuple(self._movables))
        self._meshed = meshed_beside(twin.surface)

    def take(self, change: SurfaceChange, world_from_device: Pose) -> None:
        """Take one change of the headset's mesh into the physics."""
        twin = self._twin
        assert twin is not None, "begin first"
        triangles = np.zeros((0, 3, 3))
        if isinstance(change, SpatialSurface):
            corners = world_from_device @ change.vertices_in_world_m
            triangles = corners[change.triangles]
            self._seen.add(change.id)
        else:
            self._seen.discard(change.id)
        poses = self._poses()
        movables = [(item, poses[name]) for name, item in self._movables.items()]
        self._meshed, cells = with_surface(
            self._meshed,
            twin.surface,
            surface_id=change.id,
            triangles=triangles,
            movables=movables,
        )
        if cells:
            before = twin.object_poses()
            twin.apply(change_of(twin.surface, cells))
            twin.step(2_000_000)
            self._changed(hidden_cells(self._meshed, twin.surface, cells=cells))
            self._settled_ns = self._clock.now_ns() + SETTLE_NS
            self._count(before, twin.object_poses())
        if self._is_caught_up:
            self.updates.add((self._clock.now_ns() - change.t_ns) / 1e6)
        self._note(len(cells))

    def _note(self, cells: int) -> None:
        status = self._status
        self._status = MeshStatus(
            len(self._seen),
            len(self._meshed.cells),
            self._meshed.triangles,
            status.changes + (cells > 0),
            status.largest_step_mm,
        )

    def _count(self, before: Mapping[str, Pose], after: Mapping[str, Pose]) -> None:
        """Keep the largest step that an object took by an exchange."""
        steps = [
            1e3 * float(np.linalg.norm(after[name].translation - pose.translation))
            for name, pose in before.items()
        ]
        largest = max(self._status.largest_step_mm, *steps, 0.0)
        status = self._status
        self._status = MeshStatus(
            status.surfaces, status.cells, status.triangles, status.changes, largest
        )

    def _poses(self) -> dict[str, Pose]:
        """Return where tracked objects are."""
        state = self._state
        scanned = {item.object_id: item.world_from_object for item in self._scene.objects}
        return scanned | {key: track.world_from_object for key, track in state.objects.items()}

    def _run(self, task: Task[None]) -> None:
        try:
            self.begin()
        except ValueError as error:
            self._status = MeshStatus(failure=str(error))
            return
        waiting: dict[str, SurfaceChange] = {}
        last_ns = self._clock.now_ns()
        while not task.is_cancelled:
            pose = self._world_from_device()
            if pose is None:
                task.pause(WAIT_S)
                continue
            is_moving = self._clock.now_ns() < self._settled_ns
            for change in self._surfaces.take(0.0 if waiting else WAIT_S if is_moving else IDLE_S):
                waiting[change.id] = change
            if waiting:
                self.take(waiting.pop(next(iter(waiting))), pose)
                self._is_caught_up = self._is_caught_up or not waiting
            now_ns = self._clock.now_ns()
            self.advance(min(now_ns - last_ns, STEP_NS))
            last_ns = now_ns

    def advance(self, duration_ns: int) -> None:
        """Let the physics run, with tracked objects where the tracker has them."""
        twin = self._twin
        if twin is None:
            return
        known = twin.object_poses()
        moved = {
            key: pose
            for key, pose in self._poses().items()
            if key in known and _is_away(pose, known[key])
        }
        if moved:
            twin.follow(moved, within_ns=FOLLOW_NS)
            self._settled_ns = self._clock.now_ns() + SETTLE_NS
        if self._clock.now_ns() < self._settled_ns:
            twin.step(duration_ns)


def _is_away(a: Pose, b: Pose) -> bool:
    away: NDArray[np.float64] = np.abs(a.translation - b.translation)
    return float(away.max()) > 1e-3 or float(np.abs(a.rotation - b.rotation).max()) > 5e-3


@runtime_checkable
class Hiding(Protocol):
    """Part of a hub, or of a room that sites join, that lets surfaces hide what is behind them."""

    def hide_behind(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Let surfaces hide what is behind them for everybody."""
        ...


class HiddenSurfaces:
    """Cells that hide what is behind them; whoever shows them gets all once, and then changes."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cells: dict[Cell, CollisionMesh] = {}
        self._due: list[tuple[Hiding, dict[Cell, CollisionMesh]]] = []
        """Changed cells that each has not got yet."""

    def change(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Take cells that have changed; one without triangles is gone. On any thread."""
        with self._lock:
            for _, due in self._due:
                due.update(cells)
            for cell, mesh in cells.items():
                if len(mesh.faces):
                    self._cells[cell] = mesh
                else:
                    self._cells.pop(cell, None)

    def show(self, *those: Hiding) -> None:
        """Hand each what it does not have yet; nothing where there is nothing new."""
        with self._lock:
            before = {id(each): due for each, due in self._due}
            found = [(each, before.get(id(each), dict(self._cells))) for each in those]
            self._due = [(each, {}) for each in those]
        for each, cells in found:
            if cells:
                each.hide_behind(cells)
