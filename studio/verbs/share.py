"""`nexus share`: a rehearsal as somebody else can see it, with nothing installed."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

DEFAULT_OUT = Path("out/shared")
SMALLEST_MB, LARGEST_MB = 1.0, 500.0
"""Of the viewer: below, no libraries fit; above, browsers refuse to hold it as one text."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("folder", type=Path, help="that 'nexus rehearse' or 'nexus fork' left")
    parser.add_argument(
        "--out", type=Path, default=DEFAULT_OUT, metavar="DIR", help=f"results ({DEFAULT_OUT})"
    )
    parser.add_argument(
        "--viewer-mb",
        type=_megabytes,
        default=25.0,
        metavar="MB",
        help="the viewer's size at most: the room is thinned to it (default: 25)",
    )
    parser.add_argument(
        "--scene", metavar="S", help="where the scene is now, if the recording no longer finds it"
    )
    parser.add_argument(
        "--only",
        nargs="+",
        choices=("viewer", "film", "sheet", "archive"),
        metavar="PART",
        help="make only these of viewer, film, sheet and archive",
    )
    parser.add_argument("--json", action="store_true", help="print what was made as JSON")


def run(args: argparse.Namespace) -> int:
    """Share."""
    from studio.console.progress import text_progress
    from studio.handover.share import ALL, Part, share

    shared = share(
        args.folder,
        args.out,
        progress=text_progress(),
        scene=args.scene,
        viewer_bytes=int(args.viewer_mb * 1e6),
        parts=ALL if args.only is None else frozenset(map(Part, args.only)),
    )
    if args.json:
        files = {path.name: path.stat().st_size for path in shared.paths}
        values = {"verb": "share", "folder": str(shared.folder), "bytes": files}
        print(json.dumps({**values, "splats": shared.splats, "of_splats": shared.of_splats}))
    else:
        for path in shared.paths:
            print(f"{path.stat().st_size / 1e6:8.2f} MB  {path}")
    if shared.note:
        print(f"note: {shared.note}", file=sys.stderr)
    print(f"open {shared.first}, or send it", file=sys.stderr)
    return 0


def _megabytes(text: str) -> float:
    try:
        size = float(text)
    except ValueError:
        size = float("nan")
    if not SMALLEST_MB <= size <= LARGEST_MB:
        raise argparse.ArgumentTypeError(
            f"{text!r}, wanted megabytes from {SMALLEST_MB:g} to {LARGEST_MB:g}"
        )
    return size
