"""People who are in the session another way than by this hub: shown and listed, given shapes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain

from devices.hub.channels import BodyChannel
from devices.hub.roles import Person

FIRST_INDEX, LAST_INDEX = 0x8000, 0xFFFF
"""Numbers that they get here; a hub's own people have smaller ones."""

MAX_ELSEWHERE = 1024
"""People of other hubs that are shown, chosen: 32 sites of 32 people. The first of them."""


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """Somebody in the session another way.

    Attributes:
        person: as they are there; the id is unique among all hubs, such as "north.p1".
        body: their newest, as it came; empty where none is shown.
    """

    person: Person
    body: bytes


@dataclass(slots=True)
class Others:
    """All of them, with the numbers that they have here."""

    _people: dict[str, Person] = field(default_factory=dict[str, Person])
    _bodies: dict[str, bytes] = field(default_factory=dict[str, bytes])
    _ways: dict[str, tuple[Elsewhere, ...]] = field(
        default_factory=dict[str, "tuple[Elsewhere, ...]"]
    )
    _next: int = FIRST_INDEX

    def take(self, those: Iterable[Elsewhere], bodies: BodyChannel, *, way: str = "") -> bool:
        """Show these, with bodies that are new; return whether they are others than before.

        Args:
            those: everybody who is here one way; nobody else is by that way.
            bodies: takes the new ones.
            way: such as by sites.
        """
        self._ways[way] = tuple(those)
        known_before = self._people
        before, self._people = dict(known_before), {}
        for each in chain.from_iterable(self._ways.values()):
            person_id = each.person.person_id
            if len(self._people) >= MAX_ELSEWHERE:
                break
            known = before.pop(person_id, None)
            index = self._free_index(before) if known is None else known.index
            self._people[person_id] = replace(each.person, index=index)
            if each.body != self._bodies.get(person_id, b""):
                self._bodies[person_id] = each.body
                if each.body:
                    bodies.put(index, each.body)
                else:
                    bodies.drop(index)
        for person_id, gone in before.items():
            self._bodies.pop(person_id, None)
            bodies.drop(gone.index)
        return self._people != known_before

    def people(self) -> tuple[Person, ...]:
        """Return who they are."""
        return tuple(self._people.values())

    def by_other_ways(self, way: str) -> list[Elsewhere]:
        """Return those who are here by any way but one."""
        return [each for key, those in self._ways.items() if key != way for each in those]

    def find(self, person_id: str) -> Person:
        """Return one of them.

        Raises:
            KeyError: nobody of that id is here another way.
        """
        if person_id not in self._people:
            raise KeyError(f"hub: nobody is {person_id!r} another way, see meet()")
        return self._people[person_id]

    def _free_index(self, before: dict[str, Person]) -> int:
        """Return a number that nobody has had for the longest time."""
        taken = {p.index for p in self._people.values()} | {p.index for p in before.values()}
        while self._next in taken:
            self._advance()
        found = self._next
        self._advance()
        return found

    def _advance(self) -> None:
        self._next = FIRST_INDEX if self._next == LAST_INDEX else self._next + 1
