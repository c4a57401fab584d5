"""A scenario in real time: one of its people wears the headset, and the objects move."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock
from devices.hololens.values import HandJoints, Joint, Ray
from scenes.frames import OPENGL_FROM_OPENCV, look_at
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose, interpolate
from scenes.state import Avatar
from scenes.workers.task import Task
from sim.hololens.drawing.scenery import Scenery
from sim.hololens.wearer import Stroller, WornBody
from sim.people.actors import TICK_NS, Actor, introduce
from sim.physics.any_room import physics_of
from sim.scenarios.scenario import Scenario

Array = NDArray[np.float64]

AHEAD_S = 0.15
"""How far ahead of the present it is played: a picture is drawn up to two pictures before its time,
and where somebody is then has to be known."""

KEPT = 64
"""Moments that are kept: half a second and what is ahead."""

CLOSE_S = 5.0
"""Longest wait for the thread, seconds."""


class UnknownPersonError(ValueError):
    """A scenario has nobody of that name; says who there is."""


class Followed:
    """Wearer who is where somebody says that they are, moment by moment."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._moments: deque[tuple[float, WornBody]] = deque(maxlen=KEPT)

    def put(self, t_s: float, body: WornBody) -> None:
        """Have the body at a moment later than those before."""
        with self._lock:
            self._moments.append((t_s, body))

    def at(self, t_s: float) -> WornBody:
        """Return the body at a moment; before the first and after the last as it was then.

        Raises:
            RuntimeError: nobody has said anything.
        """
        with self._lock:
            moments = tuple(self._moments)
        if not moments:
            raise RuntimeError("Followed: no moment was put yet")
        after = next((k for k, (when, _) in enumerate(moments) if when >= t_s), len(moments))
        if after in (0, len(moments)):
            return moments[min(after, len(moments) - 1)][1]
        (before_s, a), (after_s, b) = moments[after - 1], moments[after]
        share = (t_s - before_s) / max(after_s - before_s, 1e-9)
        head = interpolate(a.world_from_head, b.world_from_head, share)
        left, right = (
            _between(*pair, share=share) for pair in ((a.left, b.left), (a.right, b.right))
        )
        return WornBody(head, _ahead(head), left, right)


class Acting:
    """Plays a scenario of a room until it is closed; starts with `start`.

    Args:
        room: as the scenario wants it.
        scenario: what happens.
        person: whose headset it is; empty for the first.

    Attributes:
        wearer: that person.

    Raises:
        UnknownPersonError: there is nobody of that name.
    """

    def __init__(self, room: PhysicalRoom, scenario: Scenario, *, person: str = "") -> None:
        self.wearer = Followed()
        self._actors = [
            Actor(
                each.person_id,
                room,
                start=each.start,
                yaw=math.radians(each.facing_deg),
                actions=each.actions,
                camera_xy=room.world_from_rig.translation[:2],
            )
            for each in scenario.people
        ]
        introduce(self._actors)
        names = [actor.person_id for actor in self._actors]
        if not names or (person and person not in names):
            raise UnknownPersonError(
                f"{scenario.name}: nobody called {person!r}; wanted one of {', '.join(names)}"
            )
        self._worn = self._actors[names.index(person) if person else 0]
        self._world = physics_of(room, {actor.person_id: actor.target() for actor in self._actors})
        self._hand = _resting_hand()
        self._poses: deque[tuple[float, Mapping[str, Pose]]] = deque(maxlen=KEPT)
        self._task: Task[None] | None = None
        self._note()

    def start(self, clock: Clock, scenery: Scenery) -> None:
        """Play from this moment on, and have the objects of a scenery move."""
        began_ns = clock.now_ns()

        def play(task: Task[None]) -> None:
            while not task.pause(TICK_NS * 1e-9):
                self._play_to((clock.now_ns() - began_ns) * 1e-9, scenery)

        self._task = Task("hololens scenario", play).start()

    def close(self) -> None:
        """Stop; waits for the thread."""
        if self._task is not None:
            self._task.cancel()
            self._task.join(CLOSE_S)

    def _play_to(self, now_s: float, scenery: Scenery) -> None:
        while self._world.t_ns * 1e-9 < now_s + AHEAD_S:
            for actor in self._actors:
                actor.tick(self._world)
            self._world.move_people({actor.person_id: actor.target() for actor in self._actors})
            self._world.step(TICK_NS)
            self._note()
        due = [poses for when, poses in self._poses if when <= now_s]
        if due:
            scenery.move(due[-1])

    def _note(self) -> None:
        """Keep where everybody and everything is at the moment that physics has reached."""
        t_s = self._world.t_ns * 1e-9
        self._poses.append((t_s, dict(self._world.object_poses())))
        self.wearer.put(t_s, _body_of(self._worn.avatar(self._world), self._hand))


def _body_of(avatar: Avatar, resting: Array) -> WornBody:
    head = avatar.world_from_head
    hands = [_hand_at(hand, head, resting=resting) for hand in avatar.hands]
    left, right = hands if len(hands) == 2 else (None, None)
    return WornBody(head, _ahead(head), left, right)


def _ahead(head: Pose) -> Ray:
    return Ray(head.translation, head.rotation[:, 2])


def _hand_at(joints: Array, head: Pose, *, resting: Array) -> HandJoints | None:
    """A hand at rest, put where a person's hand is: scenarios know no fingers."""
    if not len(joints):
        return None
    flat = np.array([head.rotation[0, 2], head.rotation[1, 2], 0.0])
    if np.linalg.norm(flat) < 1e-6:
        flat = np.array([0.0, 1.0, 0.0])
    level = look_at(np.zeros(3), flat)
    positions = joints[0] + resting @ level.rotation.T
    rotations = np.broadcast_to(level.rotation @ _FINGERS_AHEAD, (len(positions), 3, 3))
    radii = np.full(len(positions), 0.009)
    return HandJoints(positions, rotations, radii, np.ones(len(positions), np.bool_))


_FINGERS_AHEAD = OPENGL_FROM_OPENCV.rotation
"""Axes of a joint from those of a level camera: y out of the back of the hand, -z ahead."""


def _resting_hand() -> Array:
    """Return (26, 3) joints about the wrist, in the axes of a level camera."""
    body = Stroller(0).at(0.0)
    assert body.right is not None
    flat = body.world_from_head.rotation[:, 2] * (1.0, 1.0, 0.0)
    level = look_at(np.zeros(3), flat)
    wrist = body.right.positions_m[Joint.WRIST]
    return (body.right.positions_m - wrist) @ level.rotation


def _between(a: HandJoints | None, b: HandJoints | None, *, share: float) -> HandJoints | None:
    if a is None or b is None:
        return b
    positions = a.positions_m + share * (b.positions_m - a.positions_m)
    return HandJoints(positions, b.rotations, b.radii_m, b.is_exact)
