"""`nexus refine SCENE`: sharpen an object or a region of a room with the photos' own resolution."""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

from scenes.package import ScenePackage, load_package, save_package
from scenes.prepare.cutout.cutout import REFINED, undo_cut
from scenes.prepare.reconstruction import View
from scenes.prepare.refine.refine import RefineOptions
from scenes.prepare.refine.scene import (
    RefinedScene,
    in_sphere,
    refine_object,
    refine_region,
)
from scenes.prepare.room_photos import views_of
from studio.console.progress import StageProgress, text_progress

MIN_STEPS = 50
"""A shorter training ends before splats are split."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `nexus refine` takes to its parser."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a scene package's folder")
    parser.add_argument(
        "objects",
        nargs="*",
        metavar="OBJECT",
        help="ids of objects that were cut out of the room (default: all of them)",
    )
    parser.add_argument(
        "--at",
        type=_place,
        metavar="X,Y,Z",
        help="sharpen what is around this place of the room instead, metres; with a minus first: "
        "--at=-1,0.5,0.7",
    )
    parser.add_argument(
        "--radius", type=_length, default=0.3, metavar="M", help="of the sphere there (0.3 m)"
    )
    parser.add_argument(
        "--steps",
        type=_steps,
        default=RefineOptions().steps,
        metavar="N",
        help="training steps an object (%(default)s)",
    )
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument(
        "--work",
        type=Path,
        metavar="DIR",
        help="work folder of the scene's preparation, which has its photos (SCENE.prepare)",
    )
    parser.add_argument("--undo", action="store_true", help="take back what was refined last")
    parser.add_argument("--json", action="store_true", help="report as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Refine or undo, and print lines or one JSON object; returns 0.

    Raises:
        ValueError: the photos are gone, or they do not show what was asked for.
        PackageError, WriteError: the scene cannot be read or written.
    """
    package = load_package(args.scene)
    if args.undo:
        report, lines = _undone(args, package)
    else:
        report, lines = _refined(args, package)
    print(
        json.dumps({"verb": "refine", "scene": str(args.scene), **report})
        if args.json
        else "\n".join(lines)
    )
    return 0


def _undone(args: argparse.Namespace, package: ScenePackage) -> tuple[dict[str, object], list[str]]:
    if not package.stages or not package.stages[-1].name.startswith(f"{REFINED} "):
        raise ValueError(
            f"{args.scene}: what was done last is no refinement; 'nexus cut {args.scene} --undo' "
            "takes it back"
        )
    save_package(undo_cut(package), args.scene)
    name = package.stages[-1].name.removeprefix(f"{REFINED} ")
    return {"undone": name}, [f"{args.scene}: {name} is as it was before it was refined"]


def _refined(
    args: argparse.Namespace, package: ScenePackage
) -> tuple[dict[str, object], list[str]]:
    work = args.work or args.scene.with_name(f"{args.scene.name}.prepare")
    views = views_of(package, work, wanted="refine it, prepare it again")
    if args.at is not None and args.objects:
        raise ValueError("nexus refine: objects and --at; give one of them")
    names = args.objects or [item.object_id for item in package.objects]
    if args.at is None and not names:
        raise ValueError(
            f"{args.scene}: no object was cut out of it; cut one out, or give --at X,Y,Z"
        )
    stages = StageProgress(text_progress())
    rows: list[dict[str, object]] = []
    for name in [None] if args.at is not None else names:
        start = time.perf_counter()
        what = name or "region"
        done = _one(args, package, name=name, views=views, stages=stages)
        package = done.package
        rows.append(
            {
                "name": what,
                "splats": len(done.refined.splats),
                "photos": done.refined.photos,
                "before_db": _rounded(done.refined.before_db),
                "after_db": _rounded(done.refined.after_db),
                "seconds": round(time.perf_counter() - start, 2),
            }
        )
    stages.finish()
    save_package(package, args.scene)
    lines = [
        f"{args.scene}: {row['name']}, {row['splats']:,} splats of {row['photos']} photos, "
        f"{row['seconds']} s" + _gain(row)
        for row in rows
    ]
    return {"refined": rows}, lines


def _one(
    args: argparse.Namespace,
    package: ScenePackage,
    *,
    name: str | None,
    views: tuple[View, ...],
    stages: StageProgress,
) -> RefinedScene:
    """Refine one object, or the region where no name is given."""

    def progress(done: float, note: str) -> None:
        stages(done, f"{name or 'region'}: {note}")

    options = RefineOptions(steps=args.steps)
    rng = np.random.default_rng(args.seed)
    if name is None:
        mask = in_sphere(package.room, centre=args.at, radius_m=args.radius)
        return refine_region(
            package, mask, views=views, options=options, rng=rng, progress=progress
        )
    try:
        return refine_object(
            package, name, views=views, options=options, rng=rng, progress=progress
        )
    except KeyError as error:
        raise ValueError(error.args[0]) from None


def _gain(row: dict[str, object]) -> str:
    if row["after_db"] is None:
        return ""
    return f", {row['before_db']} -> {row['after_db']} dB on photos kept aside"


def _rounded(value: float) -> float | None:
    return round(value, 1) if math.isfinite(value) else None


def _place(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(math.isfinite(v) and abs(v) < 1e4 for v in (x, y, z)):
        raise argparse.ArgumentTypeError(f"{text!r}: wanted metres such as 1.2,0.5,0.74")
    return x, y, z


def _length(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < 100:
        raise argparse.ArgumentTypeError(f"{text!r}: wanted metres above 0")
    return value


def _steps(text: str) -> int:
    if not text.isdigit() or int(text) < MIN_STEPS:
        raise argparse.ArgumentTypeError(f"{text}: wanted {MIN_STEPS} or more")
    return int(text)
