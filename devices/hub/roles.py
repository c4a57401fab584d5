"""Roles of people in a session, what each may do, and the pen: one person alone draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """A person's part in a session."""

    LOCAL = "local"
    REMOTE = "remote"
    OPERATOR = "operator"
    SPECTATOR = "spectator"


class Op(StrEnum):
    """A change of the session that a person can ask for."""

    LINE = "line"
    SURFACE = "surface"
    PRIMITIVE = "primitive"
    PROPOSE = "propose"
    GIVE = "give"
    UNDO = "undo"


RIGHTS: Mapping[Role, frozenset[Op]] = {
    Role.LOCAL: frozenset(Op),
    Role.REMOTE: frozenset(Op),
    Role.OPERATOR: frozenset(Op),
    Role.SPECTATOR: frozenset(),
}
"""Operations that each role may ask for; what only the operator may do is no message at all."""

SPEAKERS = frozenset({Role.LOCAL, Role.REMOTE, Role.OPERATOR})
"""Roles whose voice is heard; a spectator listens."""

SPEAK = "speak"
"""Right to be heard, as it is named beside those of operations."""


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody who is connected.

    Attributes:
        person_id: unique in the session, such as "p1".
        index: the same as a number, 0..65535.
        name: as they call themselves.
        role: their part.
        is_muted: whether their body and operations are refused.
        is_connected: false while a connection that broke may come back.
        latency_ms: round trip of the newest ping; None before the first.
        has_pen: whether they alone may draw: the operator has given them the pen.
        has_microphone: whether theirs is on.
        is_speaking: whether they are heard.
        is_yielding: whether whoever asks gets what is theirs: of a headset's wearer without a page.
    """

    person_id: str
    index: int
    name: str
    role: Role
    is_muted: bool = False
    is_connected: bool = True
    latency_ms: float | None = None
    has_pen: bool = False
    has_microphone: bool = False
    is_speaking: bool = False
    is_yielding: bool = False

    @property
    def called(self) -> str:
        """Name and id, as a line of the log has them."""
        return f"{self.name} ({self.person_id})"


def may_speak(person: Person) -> bool:
    """Return whether somebody's voice is heard: their role lets them, and they are not muted."""
    return person.role in SPEAKERS and not person.is_muted


def can_have_shapes(person: Person) -> bool:
    """Return whether somebody can be given a shape."""
    return Op.PRIMITIVE in RIGHTS[person.role]


@dataclass(slots=True)
class Pen:
    """Rights of people beside their roles.

    Attributes:
        holder: id of the person who alone may draw; empty where everybody may.
    """

    holder: str = ""

    def rights(self, person: Person) -> list[Op]:
        """Return operations that somebody may ask for now, in order."""
        is_free = not self.holder or self.holder == person.person_id
        return sorted(RIGHTS[person.role]) if is_free and not person.is_muted else []

    def refusal(self, person: Person, op: Op) -> str:
        """Return why somebody may not do an operation, in words for them; empty if they may."""
        if person.is_muted:
            return "you are muted"
        if op not in RIGHTS[person.role]:
            return f"a {person.role} may not change the room"
        if op not in self.rights(person):
            return "somebody else has the pen"
        return ""


def can_hold_pen(person: Person) -> bool:
    """Return whether the pen is of any use to somebody."""
    return bool(RIGHTS[person.role])


def named(people: Sequence[Person], name: str) -> Person:
    """Return somebody by id or by name.

    Raises:
        ValueError: nobody of that name is here, or several are.
    """
    found = [each for each in people if each.person_id == name]
    found = found or [each for each in people if each.name.casefold() == name.casefold()]
    if len(found) != 1:
        here = ", ".join(f"{each.name} ({each.person_id})" for each in people) or "nobody"
        raise ValueError(f"people: person = {name!r}, here: {here}")
    return found[0]
