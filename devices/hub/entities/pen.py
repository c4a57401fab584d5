"""The pen: everybody draws whose role allows it, or one person alone to whom it was given."""

from __future__ import annotations

from dataclasses import dataclass

from devices.hub.roles import RIGHTS, Op, Person


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
