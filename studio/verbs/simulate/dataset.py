"""`nexus simulate dataset SCENE`: what a scenario's camera delivers, with exact truth per frame."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

DEFAULT_PHOTOS = 60
"""Photos of the capture, as somebody who wants a room prepared would take them."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "scene", nargs="?", default="lab", help="built-in room or its package (default: lab)"
    )
    parser.add_argument("--scenario", metavar="F", help="name or TOML file (default: the room's)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to make")
    parser.add_argument("--check", type=Path, metavar="DIR", help="only read a written folder back")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument(
        "--form",
        choices=("room-c", "bop"),
        default="room-c",
        help="that of docs/datasets.md, or BOP's with pinhole views (default: room-c)",
    )
    parser.add_argument("--every", type=int, default=1, metavar="N", help="write every Nth frame")
    parser.add_argument(
        "--pictures",
        choices=("png", "jpg", "video"),
        default="png",
        help="of the camera; video is its own H.264 of both lenses (room-c only)",
    )
    parser.add_argument(
        "--view-px", type=int, metavar="N", help="side of BOP's views (default: as fine as a lens)"
    )
    parser.add_argument(
        "--photos",
        type=int,
        default=DEFAULT_PHOTOS,
        metavar="N",
        help=f"photos of the room beside the sequence, 0 for none (room-c; {DEFAULT_PHOTOS})",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Write, read back, and print one line.

    Raises:
        ValueError, OSError: bad input, a full disk, or a folder whose truth does not agree.
    """
    from sim.dataset.check import check_dataset

    if args.check is not None:
        checked = check_dataset(args.check)
        checked.require(args.check)
        print(json.dumps(asdict(checked)) if args.json else f"{args.check}: {checked.line()}")
        return 0
    if args.out is None:
        raise ValueError("simulate dataset: no folder to write; give --out DIR (or --check DIR)")
    return _write(args)


def _write(args: argparse.Namespace) -> int:
    from dataclasses import replace

    from sim.dataset.write import DatasetOptions, write_dataset
    from sim.phone.phone import SAMPLE_CAPTURE
    from studio.console.progress import text_progress
    from studio.session.staging import staging_of

    staging = staging_of(args.scene, args.scenario)
    room, scenario = staging.room, staging.scenario
    photos = replace(SAMPLE_CAPTURE, frames=args.photos) if args.photos > 0 else None
    options = DatasetOptions(args.form, args.every, args.pictures, args.view_px, photos)
    progress = text_progress()
    progress.begin(f"writing {args.out}")
    written = write_dataset(
        args.out,
        room,
        scenario,
        seed=args.seed,
        options=options,
        scanned=staging.scanned,
        progress=lambda done, note: progress.advance(done, note),
    )
    progress.finish(f"{written.frames} frames")
    if args.form == "room-c" and not written.photos:
        print(
            f"{args.out}: no capture/ (no photos of this room): 'nexus evaluate dataset' needs one",
            file=sys.stderr,
        )
    if args.json:
        print(json.dumps({"verb": "simulate dataset", "out": str(args.out), **asdict(written)}))
    else:
        print(
            f"{args.out}: {args.form}, {written.frames} frames of {scenario.name}, seed "
            f"{args.seed}, {written.photos} photos; {written.checked.line()}"
        )
    return 0
