"""Objects moved by the mouse in the running physics, as steps of undo in the document."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from devices.clock import Clock
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import SceneState
from studio.app.model.documents.document import Document, hand_state
from studio.app.model.workbench import Topic, Workbench
from studio.app.twin.bodies import (
    LARGEST_MESH_M,
    Body,
    base_pose,
    bodies_of,
    has_moved,
    is_same_body,
    is_same_pose,
    physical_pose,
    virtual_of,
)
from studio.app.twin.edits import EditError, name_of, put_all, taken_ids
from studio.app.twin.running_physics import RoomPoses, RunningPhysics

if TYPE_CHECKING:
    from sim.physics.by_hand import PhysicsByHand

PATIENCE_NS = 3_000_000_000
"""Time after a release in which everything should come to rest; then the step of undo is made."""
SETTLED_NS = 200_000_000
"""Time after which a body's new size is its last one: while it is dragged, each picture has another
one, and the parts of a large mesh take some tenths of a second each."""
TOUCHED_SHARE = 0.1
"""Share of `MOVED_M` and `MOVED_RAD` that counts for what was gripped: a click that moves nothing
is no step of undo."""


def physics_of(scene: ScenePackage) -> PhysicsByHand:
    """The physics of a scene, imported when it is first needed: it takes half a second."""
    from sim.physics.by_hand import physics_by_hand

    return physics_by_hand(scene)


NOTHING_FALLS = (
    "Nothing moves: all objects rest where they stand. Hold Ctrl and drag one to move it by "
    "physics, or put one into the air first."
)


class TwinPhysics:
    """Grab, throw, push, pause: what the window does with a running room. See `Grabbing`.

    `poll` has to be called while `is_busy`, on the main thread, such as 60 times a second.

    Args:
        bench: whose objects are moved.
        clock: time of the physics.
        open_physics: makes the physics of a scene.
    """

    def __init__(
        self,
        bench: Workbench,
        clock: Clock,
        open_physics: Callable[[ScenePackage], PhysicsByHand] = physics_of,
    ) -> None:
        self._bench, self._clock, self._open = bench, clock, open_physics
        self._running: RunningPhysics | None = None
        self._ended: RunningPhysics | None = None
        self._scene: ScenePackage | None = None
        self._known: dict[str, Pose] = {}
        self._bodies: dict[str, Body] = {}
        self._grabbed = ""
        self._label = ""
        self._touched: set[str] = set()
        self._count = 0
        self._has_moved = False
        self._begun = 0
        self._released_ns: int | None = None
        self._resized_ns: int | None = None
        """When a body got another size that the physics has not got yet."""
        self._shown: SceneState | None = None
        bench.listen(Topic.SCENE, self.close)
        bench.listen(Topic.SESSION, self._give_way)
        bench.listen(Topic.RECORDING, self._give_way)
        bench.listen(Topic.DOCUMENT, self._follow)

    # --- what it is doing ------------------------------------------------------------------------

    @property
    def grabbed(self) -> str:
        """Id of what is held now, or ""."""
        return self._grabbed

    @property
    def is_busy(self) -> bool:
        """Whether something is held or moving, so that `poll` has something to do."""
        return bool(self._label)

    @property
    def is_paused(self) -> bool:
        """Whether time stands still."""
        return self._running is not None and self._running.is_paused

    @property
    def why_not(self) -> str:
        """Why nothing can be grabbed now, or ""."""
        scene = self._bench.scene
        if scene is None:
            return "no scene is open"
        if not self._bench.is_by_hand and self._shown is None:
            return "a session or recording decides where objects are; close it first"
        if scene.collision is None and scene.physical is None:
            return "this scene has no collision mesh; prepare the room from its photos"
        return ""

    # --- Grabbing --------------------------------------------------------------------------------

    def grab(self, object_id: str, point_in_world: ArrayLike) -> bool:
        """See `Grabbing.grab`."""
        running = self._ready(object_id)
        if running is None:
            return False
        try:
            point = _vector("point", point_in_world)
        except EditError as error:
            self._bench.say("warning", str(error))
            return False
        running.grab(object_id, point)
        self._begin("Throw", object_id)
        self._grabbed = object_id
        return True

    def drag(self, target_in_world: ArrayLike, *, turn_rad: float = 0.0) -> None:
        """See `Grabbing.drag`."""
        target = np.asarray(target_in_world, dtype=np.float64)
        if self._grabbed and self._running is not None and np.isfinite([*target, turn_rad]).all():
            self._running.drag(target, turn_rad=turn_rad)

    def release(self) -> None:
        """See `Grabbing.release`."""
        if self._grabbed and self._running is not None:
            self._grabbed = ""
            self._released_ns = self._clock.now_ns()
            self._running.release()

    # --- further ---------------------------------------------------------------------------------

    def throw(self, object_id: str, velocity: ArrayLike) -> None:
        """Give an object a velocity (3,), m/s.

        Raises:
            EditError: there is no such object, or physics cannot run.
        """
        self._running_for(object_id).throw(object_id, _vector("velocity", velocity))
        self._begin("Throw", object_id)
        self._released_ns = self._clock.now_ns()

    def push(self, object_id: str, point_in_world: ArrayLike, impulse_ns: ArrayLike) -> None:
        """Nudge an object at a point (3,) by an impulse (3,), N·s.

        Raises:
            EditError: there is no such object, or physics cannot run.
        """
        point, impulse = _vector("point", point_in_world), _vector("impulse", impulse_ns)
        self._running_for(object_id).push(object_id, point, impulse)
        self._begin("Push", object_id)
        self._released_ns = self._clock.now_ns()

    def pause(self) -> None:
        """Let time stand still."""
        if self._running is not None:
            self._running.pause()

    def resume(self) -> None:
        """Let time go on: what hangs in the air falls.

        Raises:
            EditError: physics cannot run.
        """
        self._running_for("").resume()
        self._begin("Let fall", "")
        self._released_ns = self._clock.now_ns()

    def reset(self) -> None:
        """Put everything back to where the document has it, at rest."""
        if self._running is not None:
            self._running.stop()
            self._ended = self._running
            self._running = None
        self._end()

    def close(self) -> None:
        """End the physics: another scene is opened."""
        self.reset()
        self._scene = None

    def join(self) -> None:
        """Wait until the physics that was closed has ended: the window closes."""
        if self._ended is not None:
            self._ended.join()

    def poll(self) -> None:
        """Show where objects are, and make the step of undo once they have come to rest."""
        running = self._running
        if running is None:
            return
        if self._is_settled():
            self._follow()
        problem = running.problems.take()
        if problem is not None:
            self._bench.say("warning", problem)
        if running.failure is not None:
            self._bench.say("error", f"physics has ended: {running.failure}")
            self.reset()
            return
        frame = running.poses.take()
        if frame is None or not self._label or frame.taken < self._begun:
            return
        if self.why_not:
            self.reset()
            return
        moved = self._moved(frame)
        self._has_moved |= bool(moved)
        waited = self._released_ns is not None and (
            self._clock.now_ns() - self._released_ns > PATIENCE_NS
        )
        if frame.moving and not waited:
            self._show(moved)
            return
        self._commit(moved)
        if frame.moving:
            self._released_ns = self._clock.now_ns()
        else:
            if not self._has_moved and not self._touched:
                self._bench.say("info", NOTHING_FALLS)
                self._bench.notify(NOTHING_FALLS, "info")
            self._end()

    # --- inside ----------------------------------------------------------------------------------

    def _begin(self, verb: str, object_id: str) -> None:
        if not self._label:
            self._touched = set()
            self._count += 1
            self._has_moved = False
        self._touched |= {object_id} - {""}
        what = name_of(self._bench.document, object_id, object_id) if object_id else "objects"
        self._label = f"{verb} {what}"
        self._released_ns = None
        self._begun = 0 if self._running is None else self._running.sent

    def _end(self) -> None:
        self._label, self._grabbed, self._released_ns = "", "", None
        if self._shown is not None:
            self._shown = None
            self._bench.show_state(None)

    def _ready(self, object_id: str) -> RunningPhysics | None:
        try:
            return self._running_for(object_id)
        except EditError as error:
            self._bench.say("warning", str(error))
            return None

    def _running_for(self, object_id: str) -> RunningPhysics:
        """The physics, begun if it has not; checks that the object is there."""
        scene = self._bench.scene
        if self.why_not or scene is None:
            raise EditError(f"physics: {self.why_not}")
        document = self._bench.document
        if object_id in document.twin.meshes.keys() - bodies_of(document.twin).keys():
            raise EditError(
                f"{object_id!r}: a mesh as large as a building stands still; its longest side may "
                f"be {LARGEST_MESH_M:g} m to be moved by physics"
            )
        known = {*(item.object_id for item in scene.objects), *bodies_of(document.twin)}
        if object_id and object_id not in known:
            raise EditError(f"{object_id!r}: nothing that can be moved; wanted one of {known}")
        if self._running is None:
            self._scene = scene
            self._running = RunningPhysics(lambda: self._open(scene), self._clock)
            self._known = self._scanned(scene)
            self._bodies = {}
            self._running.start()
            self._follow()
        return self._running

    def _scanned(self, scene: ScenePackage) -> dict[str, Pose]:
        return {item.object_id: item.world_from_object for item in scene.objects}

    def _give_way(self) -> None:
        """A session or recording shows the room from now on."""
        session = self._bench.session
        is_playing = session is not None and session.is_playing
        if self._label and (is_playing or self._bench.recording is not None):
            self._shown = None
            self.reset()

    def _follow(self) -> None:
        """Let the physics have what the document has: after an edit, undo or redo."""
        running, scene = self._running, self._scene
        if running is None or scene is None:
            return
        twin = self._bench.document.twin
        bodies, is_settled = bodies_of(twin), self._is_settled()
        if is_settled:
            self._resized_ns = None
        for object_id, body in list(self._bodies.items()):
            now = bodies.get(object_id)
            if now is not None and is_same_body(now, body):
                continue
            if now is not None and not is_settled:
                self._resized_ns = self._clock.now_ns()
                continue
            running.remove(object_id)
            del self._bodies[object_id], self._known[object_id]
        for object_id, item in bodies.items():
            if object_id not in self._bodies:
                running.add(partial(virtual_of, item))
                self._bodies[object_id] = item
                self._known[object_id] = physical_pose(item)
        wanted = {**self._scanned(scene), **twin.poses}
        wanted = {key: pose for key, pose in wanted.items() if key in self._known}
        wanted |= {key: physical_pose(item) for key, item in bodies.items()}
        changed = {
            key: pose for key, pose in wanted.items() if not is_same_pose(pose, self._known[key])
        }
        if changed:
            self._known |= changed
            running.place(changed)

    def _is_settled(self) -> bool:
        """Whether bodies that are of another size have been so for a while: none is dragged."""
        since = self._resized_ns
        return since is not None and self._clock.now_ns() - since >= SETTLED_NS

    def _moved(self, frame: RoomPoses) -> dict[str, Pose]:
        """Poses of the document's items that have moved, by id."""
        bodies = bodies_of(self._bench.document.twin)
        moved: dict[str, Pose] = {}
        for object_id, pose in frame.poses.items():
            before = self._known.get(object_id)
            share = TOUCHED_SHARE if object_id in self._touched else 1.0
            if before is None or not has_moved(before, pose, share):
                continue
            body = bodies.get(object_id)
            moved[object_id] = pose if body is None else base_pose(body, pose)
        return moved

    def _show(self, moved: Mapping[str, Pose]) -> None:
        """Show the room with what has moved; moving bodies are objects of the state, too."""
        twin = self._bench.document.twin
        self._shown = hand_state(replace(twin, poses={**twin.poses, **moved}))
        self._bench.show_state(self._shown)

    def _commit(self, moved: Mapping[str, Pose]) -> None:
        document = self._bench.document
        scanned = {} if self._scene is None else self._scanned(self._scene)
        there = {key: moved[key] for key in moved if key in taken_ids(document, scanned)}
        if not there:
            return
        changed: Document = put_all(document, scanned, there)
        # What the physics has is what the document gets, so nothing is placed again.
        bodies = bodies_of(changed.twin)
        for key, pose in there.items():
            body = bodies.get(key)
            self._known[key] = pose if body is None else physical_pose(body)
        self._bench.change(self._label, changed, merge=f"physics {self._count}")
        self._bench.note(
            "twin.put", poses={key: pose.matrix().tolist() for key, pose in there.items()}
        )


def _vector(name: str, values: ArrayLike) -> np.ndarray:
    try:
        vector = np.array(values, dtype=np.float64)
    except (ValueError, TypeError):
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise EditError(f"{name} {values!r}, wanted three finite numbers x, y, z")
    return vector
