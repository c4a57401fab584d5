"""Texts in which people are told who is here, what they may, and how everything is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from devices.hub.channels import StateChannel, to_text
from devices.hub.roles import SPEAK, Person, may_speak
from devices.hub.things.board import Board
from devices.hub.things.pen import Pen


def rights_of(person: Person, pen: Pen) -> list[str]:
    """Return what somebody may do now, as they are told."""
    return [*pen.rights(person), *([SPEAK] if may_speak(person) else [])]


def rights_text(person: Person, pen: Pen) -> str:
    """Return the message by which somebody learns what they may do."""
    return to_text(
        {
            "kind": "rights",
            "role": person.role,
            "rights": rights_of(person, pen),
            "muted": person.is_muted,
        }
    )


def people_of(people: Iterable[Person], pen: Pen) -> list[dict[str, Any]]:
    """Return everybody, as everybody is told of them."""
    return [
        {
            "id": person.person_id,
            "index": person.index,
            "name": person.name,
            "role": person.role,
            "muted": person.is_muted,
            "pen": bool(pen.rights(person)),
            "microphone": person.has_microphone,
        }
        for person in people
    ]


def whole_text(fields: dict[str, Any], *, states: StateChannel, board: Board) -> str:
    """Return a message of fields and the whole state of the room."""
    state = (
        f'{{"version":{states.version},"t_us":{states.t_us},"objects":{states.whole()},'
        f"{to_text(board.whole())[1:]}"
    )
    return f'{to_text(fields)[:-1]},"state":{state}}}'
