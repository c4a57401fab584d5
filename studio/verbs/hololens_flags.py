"""Flags of a live session for the HoloLens of its local user."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import ExitStack

    from devices.clock import Clock
    from devices.hub.server import Hub
    from scenes.package import ScenePackage
    from studio.live.hololens.wearing import Wearing
    from studio.live.hololens.worn import WornPlan
    from studio.live.setup import LiveSetup


def add_hololens_flags(parser: argparse.ArgumentParser) -> None:
    """Add them."""
    group = parser.add_argument_group("the local user's HoloLens")
    group.add_argument(
        "--hololens",
        nargs="?",
        const="",
        metavar="ADDRESS",
        help="the local user wears one, at this address; with --simulated a simulated one",
    )
    group.add_argument(
        "--keep-mesh",
        action="store_true",
        help="what it has meshed and the scan has not is written into the room's package",
    )
    group.add_argument("--wearer", default="", metavar="NAME", help="of the local user")
    group.add_argument(
        "--camera-code",
        default="",
        metavar="TEXT",
        help="what the printed code on the 360° camera says",
    )
    group.add_argument(
        "--camera-code-side",
        type=float,
        default=0.1,
        metavar="M",
        help="side of its dark pattern in metres (0.1)",
    )


def with_hololens(setup: LiveSetup, args: argparse.Namespace) -> LiveSetup:
    """Return the devices with the headset that the flags ask for.

    Raises:
        ValueError: as `worn_of`.
    """
    worn = worn_of(args)
    return setup if worn is None else replace(setup, hololens=worn)


def worn_of(args: argparse.Namespace) -> WornPlan | None:
    """Return the headset that the flags ask for; None for none, or for a simulated one.

    Raises:
        ValueError: an address is missing, or is none.
    """
    from studio.live.hololens.address import worn_plan

    if args.hololens is None or (args.simulated and not args.hololens):
        return None
    if not args.hololens:
        raise ValueError(
            "--hololens: wanted its address, such as --hololens 192.168.1.40; without one it goes "
            "with --simulated"
        )
    if not 0.02 <= args.camera_code_side <= 1.0:
        raise ValueError(f"--camera-code-side {args.camera_code_side:g}: wanted 0.02 to 1 metre")
    return worn_plan(
        args.hololens,
        name=args.wearer,
        code=args.camera_code,
        code_side_m=args.camera_code_side,
    )


def wearing_of(
    args: argparse.Namespace,
    setup: LiveSetup,
    *,
    scene: ScenePackage,
    clock: Clock,
    hub: Hub | None,
    stack: ExitStack,
    say: Callable[[str], None],
) -> Wearing | None:
    """Return the local user's headset, real or simulated; None without one.

    Raises:
        ValueError: it cannot be simulated in this room.
    """
    from studio.live.hololens.wearing import worn_for

    if setup.hololens is None and args.hololens is None:
        return None
    return worn_for(
        setup.hololens,
        scene,
        scene_name=args.scene,
        seed=args.seed,
        clock=clock,
        hub=lambda: hub,
        stack=stack,
        say=say,
        name=args.wearer,
    )


def save_worn(
    args: argparse.Namespace,
    wearing: Wearing,
    *,
    scene: ScenePackage,
    out: Path,
    say: Callable[[str], None],
) -> None:
    """Write what the headset leaves behind: beside the recording, and into the room if asked for.

    Raises:
        ValueError: the room is built in, and has no folder to be written to.
    """
    wearing.save(out)
    if not args.keep_mesh:
        return
    if not Path(args.scene).is_dir():
        raise ValueError(f"--keep-mesh: {args.scene!r} is no package; it is in {out}")
    if wearing.save_into(Path(args.scene), scene):
        say(f"the headset's mesh is in {args.scene} now")
