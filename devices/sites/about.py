"""A live room as it describes itself, to whoever looks for one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

MAX_TEXT = 60
"""Characters of a text that is shown."""


@dataclass(frozen=True, slots=True)
class RoomAbout:
    """A live room.

    Attributes:
        scene: name of the room or package, as the operator gave it.
        digest: of its content: who joins needs the same.
        people: how many are in it.
    """

    scene: str
    digest: str
    people: int = 0

    def fields(self) -> dict[str, Any]:
        """Return it as it is sent."""
        return {"scene": self.scene[:MAX_TEXT], "digest": self.digest, "people": self.people}


def read_about(fields: Mapping[str, Any]) -> RoomAbout:
    """Return what was sent; what is no text or number is empty."""
    people = fields.get("people")
    count = people if isinstance(people, int) and not isinstance(people, bool) else 0
    return RoomAbout(_text(fields.get("scene")), _text(fields.get("digest")), max(0, count))


def _text(value: object) -> str:
    if not isinstance(value, str):
        return ""
    return "".join(c if c.isprintable() else " " for c in value[:MAX_TEXT])
