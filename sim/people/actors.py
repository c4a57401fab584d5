"""Scripted people. They decide where their feet and hands go; the physics decides the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.state import Annotation, Avatar
from sim.people.acts.carrying import carry, put
from sim.people.acts.handing_over import hand_over, receive
from sim.people.acts.pointing import draw, point
from sim.people.acts.pushing import push, turn
from sim.people.acts.sitting import sit, stand_up
from sim.people.acts.walking import NoWayError, hide, stand, walk
from sim.people.person import TICK_NS, Person, Script
from sim.people.posture import HEAD, Posture, head_camera, part_poses
from sim.physics.any_room import Physics
from sim.physics.moving.people import PersonTarget
from sim.scenarios.actions import (
    Action,
    Carry,
    Draw,
    HandOver,
    Hide,
    Point,
    Push,
    Put,
    Receive,
    Sit,
    Stand,
    Turn,
    Walk,
    name_of,
)
from sim.tables import ScenarioError

__all__ = ["TICK_NS", "Actor", "introduce"]


class Actor:
    """One scripted person.

    Args:
        person_id: unique; names the person's bodies in the world.
        room: for the floor and the objects' shapes.
        start: (x, y) on the floor.
        yaw: where the person faces, radians from world x.
        actions: done one after the other; then the person stands still.
        camera_xy: where the camera's stand is, to walk around it and to hide objects from it.
    """

    def __init__(
        self,
        person_id: str,
        room: PhysicalRoom,
        *,
        start: tuple[float, float],
        yaw: float,
        actions: Sequence[Action],
        camera_xy: NDArray[np.float64],
    ) -> None:
        self.person_id = person_id
        self.person = Person(person_id, room, start=start, yaw=yaw, camera_xy=camera_xy)
        self._actions = tuple(actions)
        self._index = 0
        self._script: Script | None = None
        self._shown: dict[str, Annotation] = {}

    @property
    def action_index(self) -> int:
        """Index of the action under way; the number of actions when all are done."""
        return self._index

    @property
    def ray(self) -> NDArray[np.float64] | None:
        """(2, 3) where the person points from and to, world metres, or None."""
        return self.person.ray

    def posture(self, physics: Physics) -> Posture:
        """The shape to draw: hands where the physics has them."""
        return self.person.posture(physics)

    def avatar(self, physics: Physics) -> Avatar:
        """The person as its headset reports it."""
        posture = self.posture(physics)
        hands = (posture.left_hand[None, :], posture.right_hand[None, :])
        eyes = head_camera(part_poses(posture)[HEAD])
        return Avatar(self.person_id, "local", eyes, hands, self.ray)

    def target(self) -> PersonTarget:
        """The place where the person wants feet and hands to be."""
        return self.person.target()

    def new_annotations(self) -> tuple[Annotation, ...]:
        """Return the lines that were drawn, or have grown, since this was asked last."""
        drawn = self.person.drawings
        fresh = tuple(line for key, line in drawn.items() if self._shown.get(key) is not line)
        self._shown = dict(drawn)
        return fresh

    def tick(self, physics: Physics) -> str | None:
        """Let 10 ms pass in the person's head; returns what began or ended, in words, or None.

        Raises:
            ScenarioError: an action needs a way that isn't there.
        """
        self.person.physics = physics
        if self._script is None:
            self._script = self._run()
        walked_from = self.person.body.position.copy()
        said = next(self._script, None)
        self.person.settle(float(np.linalg.norm(self.person.body.position - walked_from)))
        return said

    def go_on_with(self, actions: Sequence[Action]) -> str | None:
        """Do other actions from now on; returns what ends with that, in words, or None.

        If what was begun so far begins the new list, the rest of it follows; otherwise the person
        lets go, stops, stands up, and begins the new list here.
        """
        begun = () if self._script is None else self._actions[: self._index + 1]
        self._actions = tuple(actions)
        if self._actions[: len(begun)] == begun:
            return None
        self._index, self._script = 0, self._stand_up_and_run()
        held = self.person.let_go()
        return f"stops, lets go of {held}" if held else "stops"

    def _stand_up_and_run(self) -> Script:
        yield from stand_up(self.person)
        yield from self._run()

    def _run(self) -> Script:
        while True:
            if self._index == len(self._actions):
                yield None
                continue
            action = self._actions[self._index]
            try:
                yield from _done(self.person, action)
            except NoWayError as error:
                where = f"{self.person_id}: actions[{self._index}] ({name_of(action)})"
                raise ScenarioError(f"{where}: {error}") from None
            self._index += 1


def introduce(actors: Sequence[Actor]) -> None:
    """Let everybody know everybody else, to give and take."""
    people = {actor.person_id: actor.person for actor in actors}
    for actor in actors:
        others = {key: other for key, other in people.items() if key != actor.person_id}
        actor.person.others = others


def _done(person: Person, action: Action) -> Script:
    """An action, as it is done."""
    match action:
        case Walk():
            return walk(person, action)
        case Stand():
            return stand(action.seconds)
        case Push():
            return push(person, action)
        case Turn():
            return turn(person, action)
        case Carry():
            return carry(person, action)
        case Put():
            return put(person, action)
        case Hide():
            return hide(person, action)
        case Sit():
            return sit(person, action)
        case HandOver():
            return hand_over(person, action)
        case Receive():
            return receive(person, action)
        case Point():
            return point(person, action)
        case Draw():
            return draw(person, action)
