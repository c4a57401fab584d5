"""Flags of a live session for people who join it: here, and at sites on other machines."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from studio.live.people.hosting import Hosting
    from studio.live.sites.sharing import Sharing


def add_people_flags(parser: argparse.ArgumentParser) -> None:
    """Add them."""
    people = parser.add_argument_group("people who join from a headset or a browser")
    people.add_argument(
        "--people",
        type=int,
        nargs="?",
        const=0,
        metavar="PORT",
        help="let them join, from this computer alone (any free port)",
    )
    people.add_argument(
        "--people-open", action="store_true", help="let the network reach them, over TLS"
    )
    people.add_argument(
        "--invite", type=int, default=1, metavar="N", help="codes that are made at the start (1)"
    )
    people.add_argument(
        "--record-voices",
        action="store_true",
        help="the recording has what people say, too; their pages say so",
    )
    people.add_argument(
        "--clients",
        type=int,
        default=0,
        metavar="N",
        help="with --headless: so many simulated people join, and their delays are measured",
    )
    people.add_argument(
        "--scenario-people",
        action="store_true",
        help="with --headless and --scenario: its remote people are those who join",
    )
    sites = parser.add_argument_group("sites on other machines")
    sites.add_argument(
        "--share",
        metavar="ROUTER",
        help="let sites join by this router (HOST[:PORT] of `nexus sites router`), or 'here'",
    )
    sites.add_argument("--share-as", default="", metavar="NAME", help="of the room (the pass's)")
    sites.add_argument(
        "--pass", dest="pass_file", type=Path, metavar="FILE", help="of `nexus sites admit`"
    )


def hosting_of(args: argparse.Namespace) -> Hosting | None:
    """Return where people join, as the flags ask for; None where they do not.

    Raises:
        ValueError: a number is out of range.
    """
    from studio.live.people.hosting import Hosting

    if args.people is None and not args.people_open:
        if not (args.clients or (args.simulated and args.hololens == "")):
            return None
        invitations = 0
    else:
        invitations = args.invite
    return Hosting(
        args.people or 0,
        args.people_open,
        invitations,
        max_people=Hosting().max_people + args.clients,
        is_voice_recorded=args.record_voices,
    )


def sharing_of(args: argparse.Namespace) -> Sharing | None:
    """Return with whom the session is shared; None where it is not.

    Raises:
        ValueError: a flag goes with another one.
    """
    from studio.live.sites.sharing import Sharing

    if args.share is None:
        if args.share_as or args.pass_file is not None:
            raise ValueError("--share-as and --pass go with --share")
        return None
    return Sharing(args.share, args.share_as, args.pass_file)
