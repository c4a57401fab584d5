"""`nexus sites list ROUTER`: rooms of a building that are live."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("router", help="HOST or HOST:PORT")
    parser.add_argument(
        "--pass", dest="pass_file", type=Path, metavar="FILE", help="of `nexus sites admit`"
    )
    parser.add_argument("--json", action="store_true", help="print them as JSON")


def run(args: argparse.Namespace) -> int:
    """Print them, one a line; it takes some seconds.

    Raises:
        ValueError, OSError: a bad pass, or the router is not reached.
    """
    from studio.live.sites.reaching import live_rooms, open_way, parse_router, read_given

    address = parse_router(args.router)
    given = read_given(address, args.pass_file)
    transport = open_way(address, given, what="nexus sites list")
    try:
        rooms = live_rooms(transport)
    finally:
        transport.close()
    if args.json:
        print(json.dumps({name: asdict(about) for name, about in rooms.items()}, indent=2))
        return 0
    for name, about in rooms.items():
        people = "1 person" if about.people == 1 else f"{about.people} people"
        print(f"{name}  {about.scene}  {people}")
    if not rooms:
        print("no room is live here")
    return 0
