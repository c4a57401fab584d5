"""Layers of the view that take a while to make: errors on the floor, and the collision mesh.

They are made on threads when they are first wanted, and again for another session or scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from devices.streams import Slot
from scenes.mesh import CollisionMesh
from scenes.workers.task import Task
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.drawing.collision_wire import collision_mesh
from studio.app.viewport.drawing.floor_errors import FloorErrors, floor_errors
from studio.app.viewport.drawing.shapes import GREEN, Shape, Shown, Wire

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class _Result(Generic[T]):
    """Result of a thread; or why there is none."""

    source: object
    value: T | None
    problem: str = ""


class _Made(Generic[T]):
    """One value, made on a thread; what a newer source replaces is dropped when it comes."""

    def __init__(self, name: str) -> None:
        self.value: T | None = None
        self._name = name
        self._source: object = None
        self._results: Slot[_Result[T]] = Slot()

    def want(self, source: object, make: Callable[[], T]) -> bool:
        """Make it of that source; whether that begins now, since it has not been done before."""
        if source is self._source or source == self._source:
            return False
        self.forget()
        self._source = source
        results = self._results

        def run(_task: Task[None]) -> None:
            result: _Result[T]
            try:
                result = _Result(source, make())
            except (ValueError, OSError) as error:
                result = _Result(source, None, str(error))
            results.put(result)

        Task(self._name, run).start()
        return True

    def forget(self) -> None:
        """It is of something that is no longer shown."""
        self.value = self._source = None

    def poll(self) -> str | None:
        """Take what was made: "" if there is something new, why there is not, or None."""
        result = self._results.take()
        if result is None or result.source is not self._source:
            return None
        self.value = result.value
        return result.problem


class Layers:
    """The slow layers of all views of a bench.

    Args:
        bench: whose scene and recording they are of.
    """

    def __init__(self, bench: Workbench) -> None:
        self._bench = bench
        self._errors: _Made[FloorErrors] = _Made("floor errors")
        self._collision: _Made[Wire] = _Made("collision mesh")
        for topic in (Topic.SCENE, Topic.RECORDING, Topic.SETTINGS):
            bench.listen(topic, self.refresh)
        self.refresh()

    @property
    def shown(self) -> Shown:
        """Layers that the user wants."""
        return Shown.of(self._bench.settings.layers)

    @property
    def errors(self) -> FloorErrors | None:
        """Errors on the floor, if they are wanted and there."""
        return self._errors.value if self.shown.errors else None

    def shapes(self) -> list[Shape]:
        """Return the shapes that are wanted and ready."""
        found: list[Shape] = []
        if self.errors is not None:
            found.append(self.errors.squares)
        if self.shown.collision and self._collision.value is not None:
            found.append(self._collision.value)
        return found

    def refresh(self) -> None:
        """Make what is wanted and not there; forget what is of another scene or recording."""
        scene, recording, shown = self._bench.scene, self._bench.recording, self.shown
        if scene is None:
            self._collision.forget()
            self._errors.forget()
            return
        if shown.collision:
            self._collision.want(scene, lambda: _wire(collision_mesh(scene)))
        if recording is None:
            self._errors.forget()
        elif shown.errors and self._errors.want(
            (recording, id(scene)), lambda: floor_errors(recording, scene)
        ):
            self._bench.say("info", "reading the session's errors for the floor …")

    def poll(self) -> bool:
        """Take what threads have made; whether there is something new to draw."""
        is_new = False
        for layer in (self._errors, self._collision):
            problem = layer.poll()
            if problem:
                self._bench.say("warning", problem)
            elif problem is not None and layer is self._errors and self.errors is not None:
                self._bench.say("info", f"errors on the floor: at most {self.errors.worst_m:.3f} m")
            if problem is not None:
                is_new = True
        return is_new

    def close(self) -> None:
        """No longer follow the bench."""
        self._bench.stop_listening(self.refresh)


def _wire(mesh: CollisionMesh) -> Wire:
    return Wire("collision", mesh, GREEN)
