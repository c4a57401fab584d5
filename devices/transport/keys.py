"""Keys of members: `gn/<session>/<role>/<name>/…`, and what may be a name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

PREFIX = "gn"
"""First part of every key: other programs may use the same router."""

MAX_NAME = 40
"""Characters of a session's, member's or channel's name, chosen: a line of a list."""

MAX_KEY_BYTES = 4 + 4 * (MAX_NAME + 1)
"""Length of a key: prefix, session, role, name, kind, channel."""

ANY = "*"
"""In place of a session or a name: all of them."""

_NAME = re.compile(rf"[a-z0-9](?:[a-z0-9_-]{{0,{MAX_NAME - 1}}})")
"""A name: no part of a pattern, and the same in a file's name."""


class MemberRole(StrEnum):
    """A machine's part in a building."""

    ROOM = "room"
    """A live session: its objects, its people, what is drawn in it."""
    SITE = "site"
    """A hub elsewhere, by which people join a room."""
    WATCHER = "watcher"
    """Sees which rooms are live, and nothing else."""


class KeyNameError(ValueError):
    """A name that cannot be part of a key."""


@dataclass(frozen=True, slots=True, order=True)
class Member:
    """Somebody who publishes.

    Attributes:
        session: of a room; "*" in a pattern.
        role: room or site.
        name: unique in the session and role; "*" in a pattern.
    """

    session: str
    role: MemberRole
    name: str

    @property
    def base(self) -> str:
        """Beginning of all its keys."""
        return f"{PREFIX}/{self.session}/{self.role}/{self.name}"

    @property
    def is_pattern(self) -> bool:
        """Whether it stands for several."""
        return ANY in (self.session, self.name)

    def holds(self, member: Member) -> bool:
        """Return whether a member is one that it stands for."""
        return (
            self.role is member.role
            and self.session in (ANY, member.session)
            and self.name in (ANY, member.name)
        )


def room(name: str) -> Member:
    """Return the room that a session is named for.

    Raises:
        KeyNameError: it is no name.
    """
    return Member(check_name(name), MemberRole.ROOM, name)


def site(session: str, name: str) -> Member:
    """Return a site of a room's session.

    Raises:
        KeyNameError: one of them is no name.
    """
    return Member(check_name(session), MemberRole.SITE, check_name(name))


def check_name(name: str) -> str:
    """Return a name that may be part of a key.

    Raises:
        KeyNameError: it may not.
    """
    if not _NAME.fullmatch(name):
        raise KeyNameError(
            f"name {name[:MAX_NAME]!r}: wanted 1 to {MAX_NAME} small letters, digits, - or _"
        )
    return name


def name_of(text: str) -> str:
    """Return a name made of any text: small letters, digits and dashes; "room" of nothing."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower())[:MAX_NAME].strip("-") or MemberRole.ROOM.value


def read_key(key: str) -> tuple[Member, str, str] | None:
    """Return member, kind and channel of a key; None where it is no member's."""
    if len(key) > MAX_KEY_BYTES:
        return None
    parts = key.split("/")
    if len(parts) not in (5, 6) or parts[0] != PREFIX:
        return None
    session, role, name, kind = parts[1:5]
    channel = parts[5] if len(parts) == 6 else ""
    if role not in (MemberRole.ROOM, MemberRole.SITE):
        return None
    if not all(_NAME.fullmatch(part) for part in (session, name, kind, *filter(None, (channel,)))):
        return None
    return Member(session, MemberRole(role), name), kind, channel


def matches(pattern: str, key: str) -> bool:
    """Return whether a pattern, with `*` for one part and `**` at its end for any, holds a key."""
    wanted, given = pattern.split("/"), key.split("/")
    if wanted[-1] == "**":
        wanted = wanted[:-1]
        if len(given) < len(wanted):
            return False
        given = given[: len(wanted)]
    return len(wanted) == len(given) and all(
        part in (ANY, other) for part, other in zip(wanted, given, strict=True)
    )
