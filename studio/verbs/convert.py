"""`nexus convert A B`: from one splat format to another, or a scene to one splat file."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from scenes.formats.registry import (
    READABLE,
    WRITABLE,
    is_in_world_frame,
    read_splat_file,
    require_world_writer,
    require_writer,
)
from scenes.formats.storage.bad_rows import CountError, all_announced, in_words
from scenes.formats.storage.blocks import ROWS_PER_BLOCK, SplatBlocks, in_blocks
from scenes.formats.storage.error import refusal
from scenes.harmonics import turned
from scenes.opening import open_scene
from scenes.package import ScenePackage, is_package, save_package
from scenes.prepare.foreign.level import AXES
from scenes.samples import SAMPLE_NAMES
from scenes.splats import SplatCloud, concatenate
from studio.console.progress import Progress, text_progress

PACKAGE_SUFFIX = ".gnx"
"""Of a scene package's folder."""

SHOWN_FROM = 8 * ROWS_PER_BLOCK
"""Splats from which on a conversion takes long enough to say how far it is."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `nexus convert` takes to its parser."""
    parser.add_argument(
        "source",
        type=Path,
        metavar="A",
        help=f"a splat file ({READABLE}), a SOG folder, or a scene",
    )
    parser.add_argument(
        "target",
        type=Path,
        metavar="B",
        help=f"the file to write or replace; its ending decides the format ({WRITABLE}; "
        "the last three need the package usd-core)",
    )
    parser.add_argument(
        "--metres-per-unit",
        type=float,
        metavar="N",
        help="of A, to make a scene of it (B.gnx); if A is a scene, all its lengths times N",
    )
    parser.add_argument(
        "--height", type=float, metavar="M", help="or metres from the room's floor to its ceiling"
    )
    parser.add_argument(
        "--up", choices=tuple(AXES), help="which axis of A is up (default: it is looked for)"
    )
    parser.add_argument("--json", action="store_true", help="report as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Convert and print one line, or one JSON object; returns 0.

    Raises:
        FormatError, PackageError, WriteError: as `convert`.
    """
    if args.target.suffix == PACKAGE_SUFFIX and is_package(args.source):
        return _scaled_scene(args)
    if args.target.suffix == PACKAGE_SUFFIX:
        return _scene_of_splats(args)
    report = convert(args.source, args.target, progress=text_progress())
    print(json.dumps(report) if args.json else _line(report))
    return 0


def convert(source: Path, target: Path, *, progress: Progress) -> dict[str, object]:
    """Read `source`, write `target` whole or not at all.

    Files go through memory block by block, so they may be larger than it; scenes, SOG and USD are
    held whole. The splats keep their place: a file in the world frame (Z up) is turned to the axes
    of the format it is written to, except to PLY, which can say that it is in the world frame.

    Args:
        source: a splat file, or a scene, whose objects are put where they last were.
        target: the file to make or replace; its ending decides the format.
        progress: shows how far it is, if there are many splats.

    Returns:
        What was read and written, as plain values.

    Raises:
        FormatError, PackageError: the source is bad, or the target's ending is no writable format.
        WriteError: the target could not be written.
    """
    written, write = require_writer(target)
    if target.exists() and source.exists() and target.samefile(source):
        raise refusal(target, "", "is the file to read", "choose another name to write")
    splats, in_world = _read(source)
    if in_world:
        _, write = require_world_writer(target)

    def watched(splats: SplatBlocks) -> SplatBlocks:
        if splats.count >= SHOWN_FROM:
            splats = replace(splats, blocks=_shown(splats, target, progress))
        return splats

    announced = splats.count
    try:
        size = write(target, watched(all_announced(splats)))
    except CountError as error:
        # Formats begin with the number of splats, which is known only now.
        splats, _ = _read(source)
        splats = replace(splats, count=error.count)
        size = write(target, watched(splats))
    return {
        "verb": "convert",
        "source": str(source),
        "target": str(target),
        "splats": splats.count,
        "left_out": splats.bad.count,
        "left_out_why": in_words(splats.bad, announced),
        "sh_degree": splats.sh_degree,
        "written_sh_degree": min(splats.sh_degree, written.max_sh_degree),
        "source_bytes": _bytes(source),
        "target_bytes": size,
    }


def _scene_of_splats(args: argparse.Namespace) -> int:
    """Make a scene package of a splat file of elsewhere; returns 0.

    Raises:
        ValueError, FormatError: the file is damaged, states no unit, or shows no room.
        WriteError: the package could not be written.
    """
    from scenes.prepare.foreign.foreign import Unit, foreign_scene, no_movable_object
    from scenes.render.native import NativeRenderer

    progress = text_progress()
    progress.begin("finding floor and walls")
    package = foreign_scene(
        args.source,
        unit=Unit(args.metres_per_unit, args.height),
        up=args.up,
        renderer=NativeRenderer(),
        progress=lambda done, note: progress.advance(done, note),
    )
    save_package(package, args.target)
    progress.finish(f"{len(package.room):,} splats")
    _say_scene(args, package, "; ".join(stage.detail for stage in package.stages))
    if not args.json:
        print(no_movable_object(str(args.target)))
    return 0


def _scaled_scene(args: argparse.Namespace) -> int:
    """Write a scene package again in its true size; returns 0.

    Raises:
        ValueError, PackageError: what is asked for is no scale, or the scene cannot be read.
        WriteError: the package could not be written.
    """
    from scenes.prepare.align.rescaled import rescale_scene

    if args.metres_per_unit is None or args.height is not None or args.up is not None:
        raise ValueError(
            f"{args.source}: is a scene, upright and in metres: its scale is changed by "
            "--metres-per-unit N alone, the true metres of what it has as one metre"
        )
    progress = text_progress()
    progress.begin("scaling")
    package = rescale_scene(args.source, args.target, factor=args.metres_per_unit)
    progress.finish(f"{len(package.room):,} splats")
    _say_scene(args, package, package.stages[-1].detail)
    return 0


def _say_scene(args: argparse.Namespace, package: ScenePackage, words: str) -> None:
    """Print what became a scene: one JSON object, or one line with how."""
    if not args.json:
        print(f"{args.source} → {args.target}: {words}")
        return
    report = {"verb": "convert", "source": str(args.source), "target": str(args.target)}
    stages = {stage.name: stage.detail for stage in package.stages}
    print(json.dumps({**report, "splats": len(package.room), "stages": stages}))


def _read(source: Path) -> tuple[SplatBlocks, bool]:
    """The splats of a file or scene, and whether they are in the world frame."""
    if not (is_package(source) or str(source) in SAMPLE_NAMES):
        return read_splat_file(source), is_in_world_frame(source)
    package = open_scene(source)
    placed = [turned(item.splats, item.world_from_object) for item in package.objects]
    return in_blocks(concatenate([package.room, *placed])), True


def _shown(splats: SplatBlocks, target: Path, progress: Progress) -> Iterator[SplatCloud]:
    """The same blocks; progress advances with each."""
    progress.begin(f"writing {target.name}")
    done = 0
    for cloud in splats.blocks:
        yield cloud
        done += len(cloud)
        progress.advance(done / splats.count, f"{done:,} of {splats.count:,} splats")
    progress.finish(f"{splats.count:,} splats")


def _bytes(path: Path) -> int | None:
    if path.is_dir():
        return sum(inner.stat().st_size for inner in path.rglob("*") if inner.is_file())
    return path.stat().st_size if path.is_file() else None


def _line(report: dict[str, object]) -> str:
    lost = report["sh_degree"] != report["written_sh_degree"]
    note = "; view-dependent colour left out, .splat holds none" if lost else ""
    if report["left_out"]:
        note += f"; {report['left_out_why']}"
    size = report["source_bytes"]
    before = "" if size is None else f"{size:,} → "
    return (
        f"{report['source']} → {report['target']}: {report['splats']:,} splats, "
        f"degree {report['written_sh_degree']}, {before}{report['target_bytes']:,} bytes{note}"
    )
