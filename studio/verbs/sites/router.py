"""`nexus sites router`: the router by which a building's rooms and sites reach each other."""

from __future__ import annotations

import argparse
import sys
import threading
from pathlib import Path

LISTEN = "127.0.0.1:7447"
"""Address at which it listens by default: this computer alone."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument(
        "--listen", default=LISTEN, metavar="HOST:PORT", help=f"where (0.0.0.0: all) ({LISTEN})"
    )
    parser.add_argument(
        "--folder", type=Path, metavar="DIR", help="the building's certificates and members"
    )
    parser.add_argument(
        "--plain", action="store_true", help="without TLS and rules, for this computer alone"
    )
    parser.add_argument(
        "--write-only",
        action="store_true",
        help="write the configuration for zenohd, and run nothing",
    )
    parser.add_argument("--seconds", type=float, metavar="S", help="how long (until Ctrl-C)")


def run(args: argparse.Namespace) -> int:
    """Run it until Ctrl-C.

    Raises:
        ValueError, OSError: bad input, or the port is taken.
    """
    from studio.console.extras import require_extra
    from studio.live.sites.building import (
        ROUTER_FILE,
        building_folder,
        prepare_building,
        router_configuration,
    )
    from studio.live.sites.reaching import parse_router

    folder = args.folder or building_folder()
    listen = parse_router(args.listen)
    if not args.plain:
        prepare_building(folder, listen)
    fields = router_configuration(folder, listen, is_plain=args.plain)
    if args.write_only:
        print(folder / ROUTER_FILE)
        return 0
    require_extra("sites", what="nexus sites router")
    from devices.transport.zenoh_transport import ZenohRouter

    router = ZenohRouter(fields)
    try:
        reach = "this computer alone, without TLS" if args.plain else f"members of {folder}"
        print(f"router at {listen.words}, for {reach}; Ctrl-C ends it", file=sys.stderr, flush=True)
        threading.Event().wait(args.seconds)
    finally:
        router.close()
    return 0
