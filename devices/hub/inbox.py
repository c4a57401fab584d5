"""Everything that people have sent, newest of each, in the session's own types and axes."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from devices.hub.contract import Arrived
from devices.hub.entities.drawn import Drawn, Entity
from devices.hub.protocol.wire import Body, decode_body
from devices.hub.roles import Op, Person, Role
from scenes.frames import OPENGL_FROM_OPENCV, WORLD_FROM_GLTF
from scenes.state import Annotation, Avatar, LiveSurface, Placed, is_there

MAX_EVENTS = 256
"""Events that wait for the session; the oldest go first."""

MAX_CHANGES = 4096
"""Entities that wait, and those handed out that are remembered; the oldest go first."""


@dataclass(slots=True)
class Inbox:
    """Entities and events since the last look."""

    _changes: OrderedDict[tuple[Op, str], Entity] = field(
        default_factory=OrderedDict[tuple[Op, str], Entity]
    )
    _events: deque[tuple[str, str]] = field(
        default_factory=lambda: deque[tuple[str, str]](maxlen=MAX_EVENTS)
    )
    _handed: dict[tuple[Op, str], deque[Entity]] = field(
        default_factory=dict[tuple[Op, str], "deque[Entity]"]
    )
    _remembered: int = 0

    def draw(self, drawn: Drawn) -> None:
        """Take an entity; one of the same name that waits is replaced."""
        change = drawn.entity()
        name = (drawn.op, drawn.key)
        self._changes.pop(name, None)
        self._changes[name] = change
        while len(self._changes) > MAX_CHANGES:
            self._changes.popitem(last=False)

    def note(self, kind: str, text: str) -> None:
        """Take an event."""
        self._events.append((kind, text))

    def recognise(self, name: tuple[Op, str], sent: Entity) -> bool:
        """Return whether a value of the session's state is one that came from here.

        Those of its name that came before are forgotten: a state shows none of them again.
        """
        values = self._handed.get(name, ())
        older = next((n for n, value in enumerate(values) if value is sent), None)
        if older is None:
            return False
        self._forget(name, older)
        return True

    def see_end(self, drawn: Drawn) -> None:
        """Forget what is gone from the session's state, up to its end."""
        if drawn.is_there:
            return
        name = (drawn.op, drawn.key)
        values = self._handed.get(name, ())
        ended = next((n for n, value in enumerate(values) if not is_there(value)), -1)
        self._forget(name, ended + 1)

    def take(self) -> Arrived:
        """Return everything since the last call but people's bodies, and forget it."""
        changes = self._changes.values()
        lines = tuple(c for c in changes if isinstance(c, Annotation))
        surfaces = tuple(c for c in changes if isinstance(c, LiveSurface))
        placed = tuple(c for c in changes if isinstance(c, Placed))
        for name, change in self._changes.items():
            self._handed.setdefault(name, deque()).append(change)
            self._remembered += 1
        while self._remembered > MAX_CHANGES:
            self._forget(next(iter(self._handed)), 1)
        self._changes.clear()
        events = tuple(self._events)
        self._events.clear()
        return Arrived((), lines, surfaces, placed, events)

    def _forget(self, name: tuple[Op, str], count: int) -> None:
        """Forget the oldest values of a name."""
        for _ in range(count):
            self._handed[name].popleft()
        self._remembered -= count
        if name in self._handed and not self._handed[name]:
            del self._handed[name]


@dataclass(slots=True)
class Avatars:
    """People as the session sees them, each body decoded once."""

    _known: dict[str, tuple[bytes, Person, Avatar | None]] = field(
        default_factory=dict[str, tuple[bytes, Person, "Avatar | None"]]
    )

    def of(self, bodies: Iterable[tuple[Person, bytes]]) -> tuple[Avatar, ...]:
        """Return avatars of people and their newest bodies."""
        shown: dict[str, tuple[bytes, Person, Avatar | None]] = {}
        for person, data in bodies:
            known = self._known.get(person.person_id)
            is_same = known is not None and _called(known[1]) == _called(person)
            if known is None or known[0] is not data or not is_same:
                known = (data, person, avatar_of(decode_body(data), person))
            shown[person.person_id] = known
        self._known = shown
        return tuple(avatar for _data, _person, avatar in shown.values() if avatar is not None)


def _called(person: Person) -> tuple[Role, str]:
    """Return what an avatar has of a person beside the body."""
    return person.role, person.name


def avatar_of(body: Body, person: Person) -> Avatar | None:
    """Return a person in the session's axes; None where nobody knows where their head is.

    A hand is its (25, 3) joints; one that holds a controller is the place of the grip, (1, 3).
    """
    if body.room_from_head is None:
        return None
    hands: list[np.ndarray] = []
    for hand, controller in zip(body.hands, body.controllers, strict=True):
        if hand is not None:
            hands.append(WORLD_FROM_GLTF @ hand.joints)
        elif controller is not None:
            hands.append(WORLD_FROM_GLTF @ controller.room_from_grip.translation.reshape(1, 3))
    return Avatar(
        user_id=person.person_id,
        role="local" if person.role is Role.LOCAL else "remote",
        world_from_head=WORLD_FROM_GLTF @ body.room_from_head @ OPENGL_FROM_OPENCV,
        hands=tuple(hands),
        ray=None if body.ray is None else WORLD_FROM_GLTF @ body.ray,
        name=person.name,
    )
