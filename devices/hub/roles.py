"""Roles of people in a session, and what each may do."""

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


def may_speak(person: Person) -> bool:
    """Return whether somebody's voice is heard: their role lets them, and they are not muted."""
    return person.role in SPEAKERS and not person.is_muted


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
