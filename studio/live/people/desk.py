"""The operator's desk in a terminal: codes made anew, and people looked after, by typed lines."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Protocol

from devices.hub.contract import Invitation
from devices.hub.roles import Person, Role, named
from scenes.workers.task import Task
from studio.live.people.hosting import Hosting, who_words

STDIN = 0
"""Descriptor of standard input, which is read itself: a thread that waits for `sys.stdin` holds its
lock."""

MAX_LINE = 200
"""Characters of a line that are read: the longest command, with a name."""

HELP = (
    "Enter or 'invite [ROLE]': another code; 'people'; 'pen NAME': they alone draw, 'pen': "
    "everybody; 'mute NAME', 'unmute NAME', 'remove NAME'"
)
"""Commands in a line."""


class DeskHub(Protocol):
    """Part of a hub that the desk needs."""

    def people(self) -> tuple[Person, ...]:
        """Return who is here, and who may come back."""
        ...

    def invite(self, role: Role = ...) -> Invitation:
        """Make a code."""
        ...

    def mute(self, person_id: str, *, is_muted: bool) -> None:
        """Refuse a person's body and operations, or take them again."""
        ...

    def give_pen(self, person_id: str | None) -> None:
        """Let one person alone draw, or everybody again."""
        ...

    def remove(self, person_id: str) -> None:
        """Send a person away."""
        ...


def answer(hub: DeskHub, line: str, *, hosting: Hosting) -> str:
    """Do what a typed line asks for; return what there is to say.

    Args:
        hub: whose people they are.
        line: see `HELP`.
        hosting: with the role of a code for which none is said.
    """
    word, _, rest = line.strip()[:MAX_LINE].partition(" ")
    name = rest.strip()
    try:
        match word.lower():
            case "" | "invite":
                return _invited(hub, Role(name.lower()) if name else hosting.role)
            case "people":
                return who_words(hub.people()) or "nobody is here"
            case "pen":
                person = named(hub.people(), name) if name else None
                hub.give_pen(None if person is None else person.person_id)
                return "everybody may draw" if person is None else f"{person.name} has the pen"
            case "mute" | "unmute":
                person, is_muted = named(hub.people(), name), word.lower() == "mute"
                hub.mute(person.person_id, is_muted=is_muted)
                return f"{person.name} is {'muted' if is_muted else 'heard again'}"
            case "remove":
                person = named(hub.people(), name)
                hub.remove(person.person_id)
                return f"{person.name} was sent away"
            case _:
                return HELP
    except ValueError as error:
        return str(error)
    except KeyError:
        return f"{name} has left"


def listen(hub: DeskHub, hosting: Hosting, *, say: Callable[[str], None]) -> Task[None] | None:
    """Answer lines of standard input on a thread of its own; None where nobody can type there.

    The thread keeps no program from ending, and ends with its input.

    Args:
        hub: whose people they are.
        hosting: as the session was asked for.
        say: takes each answer.
    """
    if not _can_read():
        return None

    def read(_task: Task[None]) -> None:
        held = b""
        while data := _read():
            *lines, held = (held + data).split(b"\n")
            for line in lines:
                say(answer(hub, line.decode("utf-8", "replace"), hosting=hosting))
            held = held[-4 * MAX_LINE :]

    return Task("desk", read).start()


def _read() -> bytes:
    try:
        return os.read(STDIN, 1024)
    except OSError:
        return b""


def _can_read() -> bool:
    """Return whether a terminal's input is ours: a job in the background that reads is stopped."""
    try:
        if not os.isatty(STDIN):
            return sys.stdin is not None and not sys.stdin.closed
        return not hasattr(os, "tcgetpgrp") or os.tcgetpgrp(STDIN) == os.getpgrp()
    except (OSError, ValueError):
        return False


def _invited(hub: DeskHub, role: Role) -> str:
    invitation = hub.invite(role)
    return f"code {invitation.code} (one use, two minutes, {role}): {invitation.url}"
