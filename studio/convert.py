"""`nexus convert A B`: from one splat format to another, or a scene to one splat file."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from scenes.formats.error import refusal
from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.formats.registry import is_in_world_frame, read_splats, require_writer
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.opening import open_scene
from scenes.package import is_package
from scenes.samples import SAMPLE_NAMES
from scenes.splats import SplatCloud, concatenate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `nexus convert` takes to its parser."""
    parser.add_argument(
        "source",
        type=Path,
        metavar="A",
        help="a .ply, .compressed.ply, .splat, .spz or .sog file, a SOG folder, or a scene",
    )
    parser.add_argument(
        "target", type=Path, metavar="B", help="the .ply, .splat or .spz file to write"
    )
    parser.add_argument("--json", action="store_true", help="report as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Convert and print one line, or one JSON object; returns 0.

    Raises:
        FormatError, PackageError, WriteError: as `convert`.
    """
    report = convert(args.source, args.target)
    print(json.dumps(report) if args.json else _line(report))
    return 0


def convert(source: Path, target: Path) -> dict[str, object]:
    """Read `source`, write `target` whole or not at all.

    The splats keep their place: a file in the world frame (Z up) is turned to the axes of the
    format it is written to, except to PLY, which can say that it is in the world frame.

    Args:
        source: a splat file, or a scene, whose objects are put where they last were.
        target: the file to make or replace; its ending decides the format.

    Returns:
        What was read and written, as plain values.

    Raises:
        FormatError, PackageError: the source is bad, or the target's ending is no writable format.
        WriteError: the target could not be written.
    """
    write = require_writer(target)
    if target.exists() and source.exists() and target.samefile(source):
        raise refusal(target, "", "is the file to read", "choose another name to write")
    cloud, in_world = _read(source)
    if write is write_ply:
        comments = [WORLD_COMMENT] if in_world else []
        size = write_ply(target, cloud, comments=comments)
        written_degree = cloud.sh_degree
    else:
        if in_world:
            cloud = turned(cloud, WORLD_FROM_FORWARD_CAMERA.inverse())
        size = write(target, cloud)
        written_degree = 0 if target.name.lower().endswith(".splat") else cloud.sh_degree
    return {
        "verb": "convert",
        "source": str(source),
        "target": str(target),
        "splats": len(cloud),
        "sh_degree": cloud.sh_degree,
        "written_sh_degree": written_degree,
        "source_bytes": _bytes(source),
        "target_bytes": size,
    }


def _read(source: Path) -> tuple[SplatCloud, bool]:
    """The splats of a file or scene, and whether they are in the world frame."""
    if not (is_package(source) or str(source) in SAMPLE_NAMES):
        return read_splats(source), is_in_world_frame(source)
    package = open_scene(source)
    placed = [turned(item.splats, item.world_from_object) for item in package.objects]
    return concatenate([package.room, *placed]), True


def _bytes(path: Path) -> int | None:
    if path.is_dir():
        return sum(inner.stat().st_size for inner in path.rglob("*") if inner.is_file())
    return path.stat().st_size if path.is_file() else None


def _line(report: dict[str, object]) -> str:
    lost = report["sh_degree"] != report["written_sh_degree"]
    note = "; view-dependent colour left out, .splat holds none" if lost else ""
    size = report["source_bytes"]
    before = "" if size is None else f"{size:,} → "
    return (
        f"{report['source']} → {report['target']}: {report['splats']:,} splats, "
        f"degree {report['written_sh_degree']}, {before}{report['target_bytes']:,} bytes{note}"
    )
