"""A live session shared with sites, as the operator asked for it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from devices.clock import Clock
from devices.hub.server import Hub
from devices.sites.about import RoomAbout
from devices.transport.keys import MemberRole, check_name, name_of
from devices.transport.local import Exchange, LocalTransport
from devices.transport.transport import Transport
from scenes.package import ScenePackage
from studio.live.people.entering import People
from studio.live.people.hosting import Hosting, hosted, invitations_for, join_line
from studio.live.sites.joined_site import JoinedSite
from studio.live.sites.reaching import open_way, parse_router, read_given
from studio.live.sites.shared_room import SharedRoom
from studio.session.opening import scene_hash

HERE = "here"
"""In place of a router: a site in this very process, to try one without a second machine."""

DIGEST_CHARACTERS = 24
"""Of a scene's digest: enough to differ."""


@dataclass(frozen=True, slots=True)
class Sharing:
    """A session to be shared.

    Attributes:
        router: HOST[:PORT], or "here".
        name: of the room; empty for the pass's, or one made of the scene's.
        pass_file: the room's pass; None for a router on this computer without TLS.
    """

    router: str
    name: str = ""
    pass_file: Path | None = None


@contextmanager
def shared(
    sharing: Sharing,
    scene: ScenePackage,
    *,
    scene_name: str,
    inner: People | None,
    hub: Callable[[], Hub | None],
    clock: Clock,
    say: Callable[[str], None],
) -> Iterator[SharedRoom]:
    """Share a session until the block ends.

    Args:
        sharing: with whom.
        scene: of the session.
        scene_name: as the operator gave it.
        inner: people who join it here; None where nobody can.
        hub: returns their hub of the moment.
        clock: session time.
        say: takes a line for the log.

    Raises:
        MissingExtraError: zenoh is not installed.
        OSError: the router is not reached.
        ValueError: a name or a pass is bad.
    """
    exchange = Exchange()
    transport, name = _way(sharing, scene_name, exchange=exchange)
    about = about_scene(scene, scene_name)
    with ExitStack() as stack:
        stack.callback(transport.close)
        room = SharedRoom(
            transport,
            name,
            about=about,
            inner=inner,
            hub=hub,
            clock=clock,
            epoch=time.time_ns(),
            say=say,
        )
        stack.callback(room.close)
        room.start()
        say(f"sites: the room is shared as {name} at {sharing.router}")
        if sharing.router == HERE:
            stack.enter_context(_site_here(exchange, scene, session=name, clock=clock, say=say))
        yield room


def about_scene(scene: ScenePackage, name: str) -> RoomAbout:
    """Return what is said of a room."""
    return RoomAbout(Path(name).name, scene_hash(scene)[:DIGEST_CHARACTERS])


def name_for(role: MemberRole, asked: str, *, of_pass: tuple[MemberRole, str] | None) -> str:
    """Return the name of a machine: its pass's where it has one.

    Args:
        role: its part.
        asked: name that was asked for; empty for none.
        of_pass: role and name in its pass; None where it has none.

    Raises:
        ValueError: the pass is for another role or name.
    """
    if of_pass is None:
        return check_name(asked)
    if of_pass[0] is not role or asked not in ("", of_pass[1]):
        raise ValueError(
            f"the pass is {of_pass[0]} {of_pass[1]}'s, not {role} {asked or '…'}'s; "
            "`nexus sites admit` makes another one where the router is"
        )
    return of_pass[1]


def _way(sharing: Sharing, scene_name: str, *, exchange: Exchange) -> tuple[Transport, str]:
    usual = sharing.name or name_of(Path(scene_name).stem)
    if sharing.router == HERE:
        return LocalTransport(exchange), check_name(usual)
    address = parse_router(sharing.router)
    given = read_given(address, sharing.pass_file)
    if given is None:
        name = check_name(usual)
    else:
        of_pass = (given.admitted.role, given.admitted.name)
        name = name_for(MemberRole.ROOM, sharing.name, of_pass=of_pass)
    return open_way(address, given, what="nexus live --share"), name


@contextmanager
def _site_here(
    exchange: Exchange,
    scene: ScenePackage,
    *,
    session: str,
    clock: Clock,
    say: Callable[[str], None],
) -> Iterator[None]:
    """Run a site in this process, and say how to join it."""
    hosting = Hosting()
    with hosted(hosting, scene, clock=clock, say=say) as hub:
        site = JoinedSite(
            LocalTransport(exchange),
            session=session,
            name=HERE,
            hub=hub,
            clock=clock,
            epoch=time.time_ns(),
            say=say,
        )
        site.start()
        say(f"site: {join_line(hub, hosting, invitations=invitations_for(hub, hosting))}")
        try:
            yield
        finally:
            site.close()
