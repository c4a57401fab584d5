"""Physics on a thread of its own, at real time: commands in, poses out."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.clock import Clock
from devices.streams import BoundedQueue, Slot, StreamClosedError, StreamFullError
from scenes.pose import Pose
from scenes.workers.task import Task

if TYPE_CHECKING:
    from sim.physics.by_hand import PhysicsByHand
    from sim.physics.moving.virtual import Virtual

log = logging.getLogger(__name__)

STEP_NS = 2_000_000
"""One step of physics, as `sim.physics.world.STEP_NS`."""
TICK_NS = 1_000_000_000 // 60
"""Between two poses: a picture of 60 Hz."""
MAX_BEHIND_NS = 50_000_000
"""Time that is made up for in one tick; of more, physics runs slower than the clock instead."""
REST_NS = 250_000_000
"""Time for which everything has to be at rest: longer than anything hangs in the air at its apex
below `sim.physics.moving.rest.RESTING_M_PER_S`, which gravity gives in a millisecond."""
IDLE_S = 0.2
"""Longest wait for a command while nothing moves."""
COMMANDS = 256
"""Commands that wait at most; the thread takes them 60 times a second."""

Command = Callable[["PhysicsByHand"], object]


@dataclass(frozen=True, slots=True, eq=False)
class RoomPoses:
    """The room at one tick.

    Attributes:
        t_ns: simulated time.
        poses: `world_from_object` by id; of a primitive, of its centre.
        moving: whether physics goes on: something is held, or not yet at rest.
        taken: how many commands had been done: what `RunningPhysics.sent` was when they were sent.
    """

    t_ns: int
    poses: Mapping[str, Pose]
    moving: bool
    taken: int


@dataclass(frozen=True, slots=True, eq=False)
class _Aim:
    """Target of the hand, with its grab, so that a late drag moves nothing else."""

    grab: int
    target_in_world: NDArray[np.float64]
    turn_rad: float


class RunningPhysics:
    """A room's physics at the clock's pace. Methods are called from one thread and never wait.

    Physics goes on from a grab, push, throw or `wake` until everything is at rest; then it costs
    nothing. What is placed stays where it is put until then.

    Args:
        open_physics: makes the physics; called on the thread, since it takes a while.
        clock: its time.
    """

    def __init__(self, open_physics: Callable[[], PhysicsByHand], clock: Clock) -> None:
        self.poses: Slot[RoomPoses] = Slot()
        self.problems: Slot[str] = Slot()
        """Problems, a sentence each; physics goes on."""
        self.failure: BaseException | None = None
        """Why it ended by itself, if it did."""
        self.sent = 0
        """Commands sent so far."""
        self._open, self._clock = open_physics, clock
        self._commands: BoundedQueue[Command] = BoundedQueue(COMMANDS, name="physics commands")
        self._task = Task("physics", self._run)
        self._paused = threading.Event()
        self._aim: _Aim | None = None
        self._grab = 0
        # Below: only the thread's.
        self._physics: PhysicsByHand | None = None
        self._grip: tuple[int, str, NDArray[np.float64]] | None = None
        self._is_awake = False
        self._rest_ns = 0
        self._taken = 0
        self._due_ns: int | None = None

    # --- from outside ----------------------------------------------------------------------------

    def start(self) -> None:
        """Begin."""
        self._task.start()

    def stop(self) -> None:
        """End soon: nothing more is done after the tick that is being worked on."""
        self._task.cancel()
        self._commands.close()

    def join(self) -> None:
        """Wait until it has ended."""
        self._task.join()

    @property
    def is_paused(self) -> bool:
        """Whether time stands still."""
        return self._paused.is_set()

    def pause(self) -> None:
        """Let time stand still; commands are done nevertheless."""
        self._paused.set()

    def resume(self) -> None:
        """Let time go on."""
        self._paused.clear()
        self.wake()

    def wake(self) -> None:
        """Let everything find its rest: what was put into the air falls."""
        self._send(self._awake)

    def grab(self, object_id: str, point_in_world: ArrayLike) -> None:
        """Grip an object at a point (3,) of the world; something else is released."""
        point = np.array(point_in_world, dtype=np.float64)
        self._grab += 1
        grab = self._grab
        self._aim = _Aim(grab, point, 0.0)

        def begin(physics: PhysicsByHand) -> None:
            in_object = physics.object_pose(object_id).inverse() @ point
            physics.pull(object_id, in_object, point)
            self._grip = (grab, object_id, in_object)
            self._awake(physics)

        self._send(begin)

    def drag(self, target_in_world: ArrayLike, *, turn_rad: float = 0.0) -> None:
        """Pull the gripped point there (3,); the newest target counts."""
        target = np.array(target_in_world, dtype=np.float64)
        self._aim = _Aim(self._grab, target, turn_rad)

    def release(self) -> None:
        """Let go: what is moving flies on."""

        def end(physics: PhysicsByHand) -> None:
            self._pull(physics)
            physics.release()
            self._grip = None
            self._awake(physics)

        self._send(end)

    def push(self, object_id: str, point_in_world: ArrayLike, impulse_ns: ArrayLike) -> None:
        """Nudge an object at a point (3,) of the world by an impulse (3,), N·s."""
        point, impulse = np.array(point_in_world, float), np.array(impulse_ns, float)

        def nudge(physics: PhysicsByHand) -> None:
            physics.push(object_id, point, impulse)
            self._awake(physics)

        self._send(nudge)

    def throw(self, object_id: str, velocity: ArrayLike) -> None:
        """Give an object a velocity (3,), m/s."""
        speed = np.array(velocity, dtype=np.float64)

        def fly(physics: PhysicsByHand) -> None:
            physics.throw(object_id, speed)
            self._awake(physics)

        self._send(fly)

    def place(self, poses: Mapping[str, Pose]) -> None:
        """Put objects somewhere, at rest, out of what stands there."""

        def put(physics: PhysicsByHand) -> None:
            for object_id, pose in poses.items():
                physics.place(object_id, pose)

        self._send(put)

    def add(self, make: Callable[[], Virtual]) -> None:
        """Add a virtual object.

        Args:
            make: makes it; called on the thread, since a mesh takes a while.
        """
        self._send(lambda physics: physics.add_virtual(make()))

    def remove(self, object_id: str) -> None:
        """Take a virtual object away."""
        self._send(lambda physics: physics.remove_virtual(object_id))

    def _send(self, command: Command) -> None:
        try:
            self._commands.put(command)
        except (StreamFullError, StreamClosedError) as error:
            self.problems.put(f"physics is busy: {error}")
        else:
            self.sent += 1

    # --- on the thread ---------------------------------------------------------------------------

    def tick(self, first: Command | None = None) -> None:
        """Do what was sent, let the time pass that is due, leave the poses.

        Args:
            first: a command that was taken from the queue already.
        """
        if self._physics is None:
            self._physics = self._open()
        physics = self._physics
        did = first is not None
        if first is not None:
            self._do(first, physics)
        while (command := self._commands.take()) is not None:
            self._do(command, physics)
            did = True
        now_ns = self._clock.now_ns()
        if self._is_awake and not self._paused.is_set():
            self._pass(physics, now_ns)
        else:
            self._due_ns = None
            if not did:
                return
        self.poses.put(RoomPoses(physics.t_ns, physics.object_poses(), self._is_awake, self._taken))

    def _pass(self, physics: PhysicsByHand, now_ns: int) -> None:
        due_ns = now_ns - TICK_NS if self._due_ns is None else self._due_ns
        due_ns = max(due_ns, now_ns - MAX_BEHIND_NS)
        steps = max(0, (now_ns - due_ns) // STEP_NS)
        self._due_ns = due_ns + steps * STEP_NS
        self._pull(physics)
        physics.step(steps * STEP_NS)
        self._rest_ns = self._rest_ns + steps * STEP_NS if physics.is_at_rest else 0
        if self._rest_ns >= REST_NS:
            self._is_awake = False

    def _pull(self, physics: PhysicsByHand) -> None:
        grip, aim = self._grip, self._aim
        if grip is not None and aim is not None and aim.grab == grip[0]:
            physics.pull(grip[1], grip[2], aim.target_in_world, turn_rad=aim.turn_rad)

    def _awake(self, _physics: PhysicsByHand) -> None:
        self._is_awake, self._rest_ns = True, 0

    def _do(self, command: Command, physics: PhysicsByHand) -> None:
        self._taken += 1
        try:
            command(physics)
        except (ValueError, KeyError) as error:
            self.problems.put(f"physics: {error.args[0] if error.args else error}")

    def _run(self, task: Task[None]) -> None:
        try:
            first: Command | None = None
            while not task.is_cancelled:
                begun_ns = self._clock.now_ns()
                self.tick(first)
                first = None
                if self._is_awake and not self._paused.is_set():
                    self._clock.sleep_until(begun_ns + TICK_NS)
                else:
                    first = self._commands.take(IDLE_S)
        except Exception as error:  # whoever polls shows it; the window lives on
            log.exception("physics has ended")
            self.failure = error
            self._commands.close()
