"""`nexus studio`: the desktop window."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "scene",
        nargs="?",
        default="lab",
        help="built-in room, scene package, splat file or project (default: lab)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/sessions"),
        metavar="DIR",
        help="where every session of the window gets a folder of its own (out/sessions)",
    )
    parser.add_argument(
        "--script",
        type=Path,
        metavar="FILE",
        help="play user actions, a line each, and close the window (docs/studio.md)",
    )
    parser.add_argument(
        "--plugins", type=Path, metavar="DIR", help="folder of plug-ins (docs/plugins.md)"
    )


def run(args: argparse.Namespace) -> int:
    """Open the window and wait until it is closed."""
    from studio.console.extras import require_extra

    require_extra("studio", what="nexus studio")
    from studio.app.model.script import read_script
    from studio.console.display import why_no_window

    script = None
    if args.script is not None:
        script = read_script(args.script.read_text(encoding="utf-8-sig"), source=str(args.script))
    no_window = why_no_window()
    if no_window is not None:
        raise ValueError(f"{no_window}; 'nexus rehearse --headless' needs no window")
    from studio.app.window import open_window

    return open_window(
        args.scene,
        rehearse_to=args.out,
        script=script,
        source=str(args.script or "script"),
        plugins=args.plugins,
    )
