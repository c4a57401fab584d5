"""`nexus sites admit ROLE NAME`: a pass by which the building's router knows a machine."""

from __future__ import annotations

import argparse
from pathlib import Path

ROLES = ("room", "site", "watcher")
"""Parts of a machine, as in `devices.transport.keys.MemberRole`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("role", choices=ROLES, help="a live session, a hub elsewhere, a list")
    parser.add_argument("name", help="unique in its role: small letters, digits, - and _")
    parser.add_argument(
        "--folder", type=Path, metavar="DIR", help="the building's certificates and members"
    )


def run(args: argparse.Namespace) -> int:
    """Make it, and say where it is and what to do with it.

    Raises:
        ValueError, OSError: a bad name, or the folder cannot be written.
    """
    from devices.transport.keys import MemberRole, check_name
    from devices.transport.passes import Admitted, admit, members
    from studio.live.sites.building import building_folder, prepare_building
    from studio.live.sites.reaching import parse_router

    folder = args.folder or building_folder()
    admitted = Admitted(MemberRole(args.role), check_name(args.name))
    prepare_building(folder, parse_router("127.0.0.1"))
    was_there = admitted in members(folder)
    print(admit(folder, admitted))
    if not was_there:
        print("take it to that machine, and start the router again: it knows its members then")
    return 0
