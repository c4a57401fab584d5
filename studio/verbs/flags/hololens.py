"""Flags of a live session for the HoloLens of its local user."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import ExitStack

    from devices.clock import Clock
    from devices.hub.server import Hub
    from scenes.package import ScenePackage
    from studio.live.hololens.wearing import Wearing
    from studio.live.hololens.worn import WornPlan
    from studio.live.live import LiveSession
    from studio.live.setup import LiveSetup


HOSTILE = 100
"""Hostile visits of each kind, chosen: all kinds were over within a minute on two busy cores."""

MAX_HOSTILE = 100_000
"""Visits of each kind that may be asked for: four hours of them."""


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
    group.add_argument(
        "--hostile",
        type=int,
        metavar="N",
        help="with --headless, --simulated and --hololens: so many hostile connections of each "
        f"kind to the session's own ports while it is live ({HOSTILE}); 0 for none",
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


def is_simulated(args: argparse.Namespace) -> bool:
    """Return whether the flags ask for a simulated headset without a window."""
    return bool(args.simulated and args.headless and args.hololens == "")


def check_hostile(args: argparse.Namespace) -> None:
    """Check how many hostile visits are asked for, and fill in the usual number.

    Raises:
        ValueError: nothing is simulated that they could be counted with, or the number is bad.
    """
    if args.hostile is None:
        args.hostile = HOSTILE if is_simulated(args) else 0
    if not 0 <= args.hostile <= MAX_HOSTILE:
        raise ValueError(f"--hostile {args.hostile}: wanted 0 to {MAX_HOSTILE}")
    if args.hostile and not is_simulated(args):
        raise ValueError(
            "--hostile goes with --headless, --simulated and --hololens without an address: real "
            "people and devices are not attacked"
        )


def let_others_in(
    args: argparse.Namespace,
    *,
    wearing: Wearing | None,
    session: LiveSession,
    hub: Hub | None,
) -> None:
    """Let a simulated remote person in who points, and hostile visitors, once it is live."""
    from studio.live.hololens.simulated.headset import Attack

    if wearing is None or wearing.simulated is None or hub is None:
        return
    camera = urlsplit(session.listening_at)
    attack = Attack(args.hostile, camera.port or 0) if args.hostile else None
    wearing.simulated.let_point(hub, lambda: session.status().live_s, attack=attack)


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
