"""`nexus sites join ROUTER/SESSION SCENE`: let people here into a room on another machine."""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from devices.hub.server import Hub
    from devices.sites.about import RoomAbout
    from studio.live.sites.joined_site import JoinedSite

STATUS_S = 0.5
"""Seconds between two looks at how it goes."""

REACH_S = 5.0
"""Seconds in which a live room is heard."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("room", help="HOST[:PORT]/SESSION, as `nexus sites list` names it")
    parser.add_argument("scene", nargs="?", default="lab", help="the room's scene, as it has it")
    parser.add_argument(
        "--pass", dest="pass_file", type=Path, metavar="FILE", help="of `nexus sites admit`"
    )
    parser.add_argument("--name", default="", metavar="N", help="of this site (the pass's)")
    parser.add_argument("--people", type=int, default=0, metavar="PORT", help="(any free port)")
    parser.add_argument(
        "--people-open", action="store_true", help="let the network reach them, over TLS"
    )
    parser.add_argument(
        "--invite", type=int, default=1, metavar="N", help="codes that are made at the start (1)"
    )
    parser.add_argument("--seconds", type=float, metavar="S", help="how long (until Ctrl-C)")


def run(args: argparse.Namespace) -> int:
    """Let them in until Ctrl-C.

    Raises:
        ValueError, OSError: bad input, the room is not reached, or it is of another scene.
    """
    from devices.clock import WallClock
    from devices.transport.keys import MemberRole
    from scenes.opening import open_scene
    from studio.live.people.hosting import Hosting, hosted, invitations_for, join_line
    from studio.live.sites.joined_site import JoinedSite
    from studio.live.sites.reaching import open_way, parse_router, read_given
    from studio.live.sites.sharing import about_scene, name_for

    address = parse_router(args.room)
    if not address.session:
        raise ValueError(f"{args.room}: which room? `nexus sites list {args.room}` lists them")
    given = read_given(address, args.pass_file)
    of_pass = None if given is None else (given.admitted.role, given.admitted.name)
    name = name_for(MemberRole.SITE, args.name or ("" if of_pass else "site"), of_pass=of_pass)
    hosting = Hosting(args.people, args.people_open, args.invite)
    scene = open_scene(args.scene)
    clock = WallClock()
    with ExitStack() as stack:
        transport = open_way(address, given, what="nexus sites join")
        stack.callback(transport.close)
        hub = stack.enter_context(hosted(hosting, scene, clock=clock, say=_drop))
        site = JoinedSite(
            transport,
            session=address.session,
            name=name,
            hub=hub,
            clock=clock,
            epoch=time.time_ns(),
            say=_say,
        )
        stack.callback(site.close)
        site.start()
        about = _wait_for_room(site, args.room)
        own = about_scene(scene, args.scene)
        if about.digest and about.digest != own.digest:
            raise ValueError(
                f"{args.room} is of scene {about.scene!r} ({about.digest[:8]}), {args.scene} is "
                f"another ({own.digest[:8]}): give the same package"
            )
        _say(join_line(hub, hosting, invitations=invitations_for(hub, hosting)))
        _watch_over(site, hub, seconds=args.seconds)
    return 0


def _wait_for_room(site: JoinedSite, room: str) -> RoomAbout:
    end_s = time.monotonic() + REACH_S
    while time.monotonic() < end_s:
        about = site.status().about
        if about is not None:
            return about
        time.sleep(0.02)
    raise OSError(f"{room}: no such room is live, or this pass does not hear it")


def _watch_over(site: JoinedSite, hub: Hub, *, seconds: float | None) -> None:
    """Say how it goes and who is here, until its time is over."""
    from studio.live.people.hosting import who_words

    said, end_s = "", None if seconds is None else time.monotonic() + seconds
    while end_s is None or time.monotonic() < end_s:
        status = site.status()
        reached = "in the room" if status.is_reached else "the room is not reached"
        elsewhere = f"{status.others} elsewhere" if status.others else ""
        line = "; ".join(filter(None, (reached, who_words(hub.people()), elsewhere)))
        if line != said:
            said = line
            _say(line)
        time.sleep(STATUS_S)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _drop(_line: str) -> None:
    """Say nothing: who is here is on the status line."""
