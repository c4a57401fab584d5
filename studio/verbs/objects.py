"""`nexus objects SCENE`: list a scene's objects, what photos saw of each, and what they missed."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

from scenes.opening import open_scene
from scenes.package import ScenePackage, is_package, save_package
from scenes.prepare.cutout.coverage.in_photos import missing_records, with_coverage
from scenes.prepare.cutout.coverage.standpoints import Advice, advice_for
from scenes.render.native import NativeRenderer
from scenes.state import ObjectModel
from studio.reports.seen_sides import advice_lines, coverage_values, seen_sides, seen_words


@dataclass(frozen=True, slots=True, eq=False)
class _Listed:
    item: ObjectModel
    advice: Advice | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `nexus objects` takes to its parser."""
    parser.add_argument(
        "scene", metavar="SCENE", help="a scene package's folder, or a built-in room's name"
    )
    parser.add_argument(
        "--id", action="append", default=[], metavar="ID", help="only this object; may be repeated"
    )
    parser.add_argument(
        "--keep",
        action="store_true",
        help="keep in the scene what had to be measured: objects cut out by an older program",
    )
    parser.add_argument("--json", action="store_true", help="report as one JSON object")


def run(args: argparse.Namespace) -> int:
    """List objects, and print lines or one JSON object; returns 0.

    Raises:
        ValueError: there is no such scene or object, or nothing can be kept in it.
        PackageError, WriteError: the scene cannot be read or written.
    """
    folder = Path(args.scene)
    if args.keep and not is_package(folder):
        raise ValueError(f"nexus objects --keep: {args.scene!r} is no scene package's folder")
    package = open_scene(args.scene)
    wanted = _wanted(package, args.id)
    renderer = NativeRenderer()
    missing = [object_id for object_id in missing_records(package) if object_id in wanted]
    for object_id in missing:
        package = with_coverage(package, object_id, renderer=renderer)
    if args.keep and missing:
        save_package(package, folder)
    listed = [
        _Listed(
            item,
            None
            if item.coverage is None
            else advice_for(package, item, coverage=item.coverage, renderer=renderer),
        )
        for item in package.objects
        if item.object_id in wanted
    ]
    if args.json:
        report = {
            "verb": "objects",
            "scene": args.scene,
            "views": len(package.views),
            "kept": len(missing) if args.keep else 0,
            "objects": [coverage_values(row.item, row.advice) for row in listed],
        }
        print(json.dumps(report))
    else:
        print("\n".join(_lines(args.scene, package, listed=listed)))
    return 0


def _wanted(package: ScenePackage, ids: list[str]) -> list[str]:
    known = [item.object_id for item in package.objects]
    for object_id in ids:
        if object_id not in known:
            raise ValueError(
                f"scene {package.name!r} has no object {object_id!r}; it has: "
                f"{', '.join(known) or 'none'}"
            )
    return ids or known


def _lines(scene: str, package: ScenePackage, *, listed: list[_Listed]) -> list[str]:
    lines = [f"{scene}: {len(package.objects)} objects, {len(package.views)} photos"]
    for row in listed:
        item = row.item
        size = " × ".join(f"{100 * side:.0f}" for side in item.box_m)
        lines.append(f"{item.object_id}: {item.name}, {size} cm, {seen_words(item)}")
        if item.coverage is None or row.advice is None:
            continue
        seen = seen_sides(item.coverage)
        shares = (f"{side} {100 * share:.0f} %" for side, share in seen.sides.items())
        lines.append(f"  seen of its sides: {', '.join(shares)}")
        lines += [f"  {line}" for line in advice_lines(row.advice, seen)]
    return lines
