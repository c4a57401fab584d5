"""Layers of the view that take a while to make: errors, the collision mesh, unseen sides.

They are made on threads when they are first wanted, and again for another session or scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from devices.streams import Slot
from scenes.coverage.directions import unpacked
from scenes.coverage.sides import BOTTOM, GRID, NORMALS, box_cells
from scenes.mesh import BoxPart, CollisionMesh
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.prepare.cutout.coverage.in_photos import missing_records, with_coverage
from scenes.render.native import NativeRenderer
from scenes.state import ObjectModel
from scenes.workers.task import Task
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.by_hand.items import pose_of
from studio.app.viewport.drawing.floor_errors import FloorErrors, floor_errors
from studio.app.viewport.drawing.shapes import GREEN, Colour, Shape, Shown, Squares, Wire

T = TypeVar("T")

FACES = ((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
         (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3))  # fmt: skip
"""Triangles of a box whose corner i has x, y and z by the bits 4, 2 and 1 of i."""

ORANGE: Colour = (0.95, 0.55, 0.1)
"""Of what nobody saw: no wood or wall has it, and it differs from the green of collision meshes."""

OPACITY = 0.45
"""Of the squares: the splats behind them stay visible."""

OUTSIDE_M = 0.006
"""Of the box, where they are drawn, metres: splats reach past their surface by about this."""


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
        self.source: object = None
        self._results: Slot[_Result[T]] = Slot()

    def want(self, source: object, make: Callable[[], T]) -> bool:
        """Make it of that source; whether that begins now, since it has not been done before."""
        if source is self.source or source == self.source:
            return False
        self.forget()
        self.source = source
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
        self.value = self.source = None

    def poll(self) -> str | None:
        """Take what was made: "" if there is something new, why there is not, or None."""
        result = self._results.take()
        if result is None or result.source is not self.source:
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
        self._measured: _Made[ScenePackage] = _Made("what photos saw of objects")
        self._unseen: dict[str, tuple[Pose, Squares | None]] = {}
        """Unseen sides by object, and the pose at which they were laid out."""
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
        scene = self._measured.value or self._bench.scene
        if self.shown.unseen and scene is not None:
            sides = [self._unseen_sides(item) for item in scene.objects]
            found += [squares for squares in sides if squares is not None]
        return found

    def _unseen_sides(self, item: ObjectModel) -> Squares | None:
        """Unseen sides of an object where it is shown; laid out anew only once it has moved."""
        pose = pose_of(self._bench, item.object_id) or item.world_from_object
        laid = self._unseen.get(item.object_id)
        if laid is None or not np.array_equal(laid[0].matrix(), pose.matrix()):
            laid = (pose, unseen_squares(item, pose))
            self._unseen[item.object_id] = laid
        return laid[1]

    def refresh(self) -> None:
        """Make what is wanted and not there; forget what is of another scene or recording."""
        scene, recording, shown = self._bench.scene, self._bench.recording, self.shown
        self._unseen.clear()
        if scene is None:
            self._collision.forget()
            self._errors.forget()
            self._measured.forget()
            return
        if self._measured.value is not None and self._measured.source is not scene:
            self._measured.forget()
        if shown.unseen and any(missing_records(scene)):
            self._measured.want(scene, lambda: _measured(scene))
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
        for layer in (self._errors, self._collision, self._measured):
            problem = layer.poll()
            if problem:
                self._bench.say("warning", problem)
            elif problem is not None and layer is self._errors and self.errors is not None:
                self._bench.say("info", f"errors on the floor: at most {self.errors.worst_m:.3f} m")
            if problem is not None:
                is_new = True
                self._unseen.clear()
        return is_new

    def close(self) -> None:
        """No longer follow the bench."""
        self._bench.stop_listening(self.refresh)


def _measured(scene: ScenePackage) -> ScenePackage:
    """The scene with what its photos saw of every object."""
    renderer = NativeRenderer()
    for object_id in missing_records(scene):
        scene = with_coverage(scene, object_id, renderer=renderer)
    return scene


def _wire(mesh: CollisionMesh) -> Wire:
    return Wire("collision", mesh, GREEN)


def collision_mesh(scene: ScenePackage) -> CollisionMesh:
    """The mesh that stops objects in a scene, world metres.

    Raises:
        ValueError: nothing in the scene stops anything.
    """
    from scenes.samples import SAMPLE_NAMES, sample_room

    if scene.collision is not None:
        return scene.collision
    solids = sample_room(str(scene.physical)).solids if scene.physical in SAMPLE_NAMES else ()
    if not solids:
        raise ValueError(
            f"{scene.name}: the scene has no collision mesh; prepare it from its photos to get one"
        )
    return boxes_mesh(solids)


def boxes_mesh(solids: Sequence[BoxPart]) -> CollisionMesh:
    """Boxes as triangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    vertices = [solid.object_from_box @ (corners * solid.half_size_m) for solid in solids]
    faces = [np.array(FACES) + 8 * number for number in range(len(solids))]
    return CollisionMesh(
        np.concatenate(vertices).astype(np.float32), np.concatenate(faces).astype(np.int32)
    )


def unseen_squares(item: ObjectModel, world_from_object: Pose) -> Squares | None:
    """The unseen cells of an object's box; None where photos saw all, or nobody has measured it.

    Its underside is left out: it stands on that.

    Args:
        item: the object.
        world_from_object: its pose as it is shown.
    """
    if item.coverage is None:
        return None
    is_unseen = ~unpacked(item.coverage.sides)
    is_unseen[BOTTOM] = False
    if not is_unseen.any():
        return None
    middles = box_cells(item.box_m).points
    found: list[np.ndarray] = []
    for side in np.flatnonzero(is_unseen.any(axis=1)):
        half = np.array(item.box_m) / (2 * GRID) * (1.0 - np.abs(NORMALS[side]))
        first, second = (axis for axis in range(3) if NORMALS[side][axis] == 0.0)
        turns = np.ones((4, 3))
        turns[:, first], turns[:, second] = (-1, 1, 1, -1), (-1, -1, 1, 1)
        cells = middles[side][is_unseen[side]] + OUTSIDE_M * NORMALS[side]
        found.append(cells[:, None, :] + turns * half)
    corners = np.concatenate(found)
    world = (world_from_object @ corners.reshape(-1, 3)).reshape(corners.shape)
    colours = np.tile(ORANGE, (len(corners), 1))
    return Squares(f"unseen {item.object_id}", world, colours, OPACITY)
