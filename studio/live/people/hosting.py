"""A hub beside a live session: where it listens, how people join, who is here."""

from __future__ import annotations

import os
from collections import ChainMap
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from devices.clock import Clock
from devices.hub.contract import Asset, HubSettings, Invitation
from devices.hub.entry.pairing import MAX_CODES
from devices.hub.entry.tokens import Tokens
from devices.hub.roles import Person, Role
from devices.hub.server import Hub
from scenes.package import ScenePackage
from studio.live.people.page import page_assets, page_folder

LOOPBACK, NETWORK = "127.0.0.1", "0.0.0.0"
"""Addresses on which a hub listens: for this computer alone, and for everybody who reaches it."""

MAX_NAMED = 6
"""People who are named in a line, chosen: a line of a terminal."""


@dataclass(frozen=True, slots=True)
class Hosting:
    """People in a live session, as the operator asked for them.

    Attributes:
        port: where the hub listens; 0 for any free one.
        is_open: whether the network reaches it, over TLS; else this computer alone.
        invitations: codes that are made at the start.
        role: of whoever joins with one of them.
        max_people: more are refused, as the room is full.
        is_voice_recorded: whether the recording has people's voices; everybody is told.

    Raises:
        ValueError: a number is out of range.
    """

    port: int = 0
    is_open: bool = False
    invitations: int = 1
    role: Role = Role.REMOTE
    max_people: int = 32
    is_voice_recorded: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise ValueError(f"--people {self.port}: wanted a port from 0 to 65535")
        if not 0 <= self.invitations <= MAX_CODES:
            raise ValueError(f"--invite {self.invitations}: wanted 0 to {MAX_CODES}")


@contextmanager
def hosted(
    hosting: Hosting,
    scene: ScenePackage,
    *,
    clock: Clock,
    say: Callable[[str], None],
    tokens: Tokens | None = None,
    asks: str = "",
    more: MutableMapping[str, Asset] | None = None,
) -> Iterator[Hub]:
    """Run a hub for a scene until the block ends.

    Args:
        hosting: where it listens.
        scene: shown to those who join.
        clock: session time.
        say: takes a line for the log.
        tokens: by which people come back; None for the hub's own.
        asks: path of what a study asks those who are on the page; empty where there is none.
        more: files beside those of the page, looked up at each request.

    Raises:
        OSError: the port is taken, or the certificate cannot be made.
    """
    settings = HubSettings(
        NETWORK if hosting.is_open else LOOPBACK,
        hosting.port,
        certificate_folder() if hosting.is_open else None,
        hosting.max_people,
        is_voice_recorded=hosting.is_voice_recorded,
    )
    page = dict(page_assets(scene, page_folder(scene), asks=asks))
    assets = ChainMap(page if more is None else more, page)
    hub = Hub(settings, assets, clock=clock, say=say, tokens=tokens)
    hub.start()
    try:
        yield hub
    finally:
        hub.close()


def certificate_folder() -> Path:
    """Return the folder of the hub's certificates: in NEXUS_HOME, else in the user's data."""
    import platformdirs

    named = os.environ.get("NEXUS_HOME")
    home = Path(named) if named else Path(platformdirs.user_data_dir("gaussiannexus-studio"))
    return home / "certificates"


def invitations_for(hub: Hub, hosting: Hosting) -> tuple[Invitation, ...]:
    """Make the codes that were asked for."""
    return tuple(hub.invite(hosting.role) for _ in range(hosting.invitations))


def join_line(hub: Hub, hosting: Hosting, *, invitations: Sequence[Invitation]) -> str:
    """Return one line that says how to join, and whom the hub lets in."""
    reach = "open to the network, over TLS" if hosting.is_open else "for this computer alone"
    line = f"people join at {hub.url} ({reach})"
    if not invitations:
        return line
    codes = ", ".join(invitation.code for invitation in invitations)
    return f"{line} with code {codes} (one use, two minutes, {hosting.role})"


def who_words(people: Sequence[Person]) -> str:
    """Return who is here in words; empty where nobody is."""
    if not people:
        return ""
    names = [_name(person) for person in sorted(people, key=lambda each: each.index)]
    if len(names) > MAX_NAMED:
        names[MAX_NAMED:] = [f"{len(names) - MAX_NAMED} more"]
    return f"{len(people)} {'person' if len(people) == 1 else 'people'} here: {', '.join(names)}"


def _name(person: Person) -> str:
    """Return a name, with what is to be known of a person."""
    notes = [str(person.role)] if person.role is not Role.REMOTE else []
    notes += ["muted"] if person.is_muted else []
    notes += [] if person.is_connected else ["away"]
    return f"{person.name} ({', '.join(notes)})" if notes else person.name
