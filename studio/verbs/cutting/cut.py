"""`nexus cut SCENE`: make a movable object of a part of a room, or put it back."""

from __future__ import annotations

import argparse
import json
import math
import re
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cut import Cut
from scenes.formats.storage.atomic import write_file
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.cutout import Cutout, cut_marked, make_object, undo_cut
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.marks.masks import Masks, Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView, drawn_picture
from scenes.prepare.cutout.proposals import Proposal, propose
from scenes.prepare.cutout.remainder.floaters import remove_floaters
from scenes.prepare.cutout.votes.lifting import share
from scenes.render.native import NativeRenderer
from studio.reports.seen_sides import coverage_values, seen_words
from studio.verbs.cutting import add, clean
from studio.verbs.cutting.own_photos import own_photo

OUTLINE_RGB = (255, 64, 32)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `nexus cut` takes to its parser."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a scene package's folder")
    parser.add_argument("--name", metavar="N", help="what the object is called")
    parser.add_argument(
        "--id", metavar="ID", help="its id in the scene; made of the name if absent"
    )
    parser.add_argument(
        "--kind", default="", metavar="K", help="what identical twins share, such as 'chair'"
    )
    parser.add_argument(
        "--box",
        action="append",
        nargs=5,
        default=[],
        metavar=("VIEW", "X0", "Y0", "X1", "Y1"),
        help="a box in pixels around the whole object in one view; give two or three views",
    )
    for flag, what in (("--click", "on the object"), ("--stroke-out", "beside the object")):
        parser.add_argument(
            flag,
            action="append",
            nargs="+",
            default=[],
            metavar="VIEW X Y",
            help=f"a view, and one or more points {what} in pixels",
        )
    parser.add_argument(
        "--photos",
        type=Path,
        metavar="DIR",
        help="your photos, named as the views, with marks in their pixels; else splats are drawn",
    )
    parser.add_argument(
        "--masks-model",
        type=Path,
        metavar="FILE.onnx",
        help="encoder of a SAM 2 export, its decoder beside it, to find masks with; else GrabCut",
    )
    parser.add_argument(
        "--preview", type=Path, metavar="DIR", help="leave a picture of what was found per view"
    )
    parser.add_argument("--views", action="store_true", help="list the scene's views and end")
    parser.add_argument(
        "--propose", action="store_true", help="list what stands free and looks movable"
    )
    parser.add_argument(
        "--accept", type=int, metavar="K", help="with --propose: cut out the K-th of the list"
    )
    parser.add_argument(
        "--floaters", action="store_true", help="remove stray splats that hang in the room"
    )
    parser.add_argument(
        "--undo",
        action="store_true",
        help="put back what was cut last, or take away what was added",
    )
    parser.add_argument("--json", action="store_true", help="report as one JSON object")
    clean.add_arguments(parser)
    add.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Cut, undo or list, and print lines or one JSON object; returns 0.

    Raises:
        ValueError: the marks do not fit the scene, or there is no object in them.
        PackageError, WriteError: the scene cannot be read or written.
    """
    package = load_package(args.scene)
    if args.views:
        report: dict[str, object] = {"views": [view.name for view in package.views]}
        lines = [view.name for view in package.views] or ["the scene has no views"]
    elif args.undo:
        before = undo_cut(package)
        save_package(before, args.scene)
        last = package.cuts[-1]
        report = {"undone": last.object_id, "objects": [item.object_id for item in before.objects]}
        lines = [f"{args.scene}: {_put_back(last)}, {len(before.room):,} splats"]
    elif args.floaters:
        cleared, count = remove_floaters(package)
        if count:
            save_package(cleared, args.scene)
        report = {"floaters": count}
        lines = [f"{args.scene}: {count} stray splats removed"]
    elif args.clean:
        cleaned, report, lines = clean.clean(args, package)
        save_package(cleaned, args.scene)
    elif args.add is not None:
        report, lines = _add(args, package)
    elif args.propose and args.accept is None:
        report, lines = _listed(propose(package.room))
    else:
        report, lines = _cut(args, package)
    print(
        json.dumps({"verb": "cut", "scene": str(args.scene), **report})
        if args.json
        else "\n".join(lines)
    )
    return 0


def _put_back(last: Cut) -> str:
    """Return in words what undoing a cut has done."""
    if last.replaced is not None:
        return f"{last.object_id} is as it was before it was refined"
    how = "put back" if len(last.taken) else "taken away again"
    return f"{last.object_id or 'floaters'} {how}"


def _cut(args: argparse.Namespace, package: ScenePackage) -> tuple[dict[str, object], list[str]]:
    object_id = _object_id(args)
    start = time.perf_counter()
    views: list[PromptedView] = []
    if args.propose:
        found = accepted(propose(package.room), args.accept)
        done = make_object(
            package,
            found,
            object_id=object_id,
            name=args.name,
            kind=args.kind,
            renderer=NativeRenderer(),
        )
    else:
        prompts = prompts_of(args.box, args.click, args.stroke_out)
        views = prompted_views(package, prompts, args.photos)
        done = cut_marked(
            package,
            views,
            object_id=object_id,
            name=args.name,
            kind=args.kind,
            masks=_masks(args),
            renderer=NativeRenderer(),
        )
    seconds = time.perf_counter() - start
    save_package(done.package, args.scene)
    if args.preview is not None:
        write_previews(args.preview, package, views, done)
    return _reported(args.scene, done, seconds=seconds)


def _reported(scene: Path, done: Cutout, *, seconds: float) -> tuple[dict[str, object], list[str]]:
    """A cut as one JSON object, and in lines."""
    size_cm = [round(100 * extent, 1) for extent in done.box.size_m]
    report: dict[str, object] = {
        "object": done.item.object_id,
        "splats": len(done.item.splats),
        "floaters": done.floaters,
        "filled": done.filled,
        "relit": done.relit,
        "box_cm": size_cm,
        "standing": done.box.supported,
        "seconds": round(seconds, 2),
        "seen": coverage_values(done.item)["seen"],
        "seen_words": seen_words(done.item),
        "notes": list(done.notes),
        "views": [
            {"name": v.name, "agreement": round(v.overlap, 3), "used": v.used} for v in done.views
        ],
    }
    lines = [
        f"{scene}: {done.item.object_id}, {len(done.item.splats):,} splats, "
        f"{' × '.join(f'{side:g}' for side in size_cm)} cm, {done.floaters} floaters removed, "
        f"{done.filled:,} splats filled in below, {done.relit:,} taken out of its shadow, "
        f"{seconds:.1f} s",
        f"  {seen_words(done.item)}; 'nexus objects' says which photos would help",
        *(f"  note: {note}" for note in done.notes),
    ]
    lines += [
        f"  {v.name}: left out, its mask fits the others by {v.overlap:.0%} only"
        for v in done.views
        if not v.used
    ]
    return report, lines


def _add(args: argparse.Namespace, package: ScenePackage) -> tuple[dict[str, object], list[str]]:
    object_id = _object_id(args)
    marked = args.box or args.click or args.stroke_out
    added = add.add(
        args,
        package,
        object_id=object_id,
        prompts=prompts_of(args.box, args.click, args.stroke_out) if marked else {},
        masks=_masks(args),
    )
    save_package(added.package, args.scene)
    if args.preview is not None:
        write_previews(args.preview, added.captured.package, added.prompted, added.cutout)
    item, captured = added.package.objects[-1], added.captured
    size_cm = [round(100 * extent, 1) for extent in item.box_m]
    place_m = [round(float(x), 3) for x in item.world_from_object.translation]
    # Of few photos none is kept aside.
    psnr_db = round(captured.training.psnr_db, 1) if captured.training.held_out else None
    report: dict[str, object] = {
        "object": object_id,
        "photos": len(captured.sfm.placed),
        "psnr_db": psnr_db,
        "splats": len(item.splats),
        "box_cm": size_cm,
        "place_m": place_m,
        "yaw_deg": round(math.degrees(item.world_from_object.yaw()), 1),
        "where": added.where,
        "seen": coverage_values(item)["seen"],
        "notes": list(captured.alignment.warnings),
    }
    judged = f" ({psnr_db:g} dB on those kept aside)" if psnr_db is not None else ""
    lines = [
        f"{args.scene}: {object_id} added, {len(item.splats):,} splats from "
        f"{len(captured.sfm.placed)} photos{judged}, "
        f"{' × '.join(f'{side:g}' for side in size_cm)} cm, {added.where} "
        f"({', '.join(f'{x:g}' for x in place_m)} m)"
    ]
    lines.append(f"  {seen_words(item)}")
    return report, [*lines, *(f"  note: {note}" for note in captured.alignment.warnings)]


def _object_id(args: argparse.Namespace) -> str:
    if not args.name:
        raise ValueError("nexus cut: what is the object called? give --name")
    return args.id or id_of(args.name)


def _masks(args: argparse.Namespace) -> Masks | None:
    if args.masks_model is None:
        return None
    # Its runtime is an extra, which GrabCut does without.
    from scenes.prepare.cutout.marks.sam_masks import SamMasks

    return SamMasks(args.masks_model)


def _listed(proposals: Sequence[Proposal]) -> tuple[dict[str, object], list[str]]:
    rows = [
        {
            "number": number,
            "score": round(item.score, 2),
            "splats": int(item.found.labels.sum()),
            "box_cm": [round(100 * side, 1) for side in item.box.size_m],
            "place_m": [round(float(x), 2) for x in item.box.world_from_box.translation],
        }
        for number, item in enumerate(proposals, 1)
    ]
    lines = [
        f"{row['number']:>3}  {' × '.join(f'{side:g}' for side in row['box_cm'])} cm at "
        f"{', '.join(f'{x:g}' for x in row['place_m'])} m, {row['splats']:,} splats"
        for row in rows
    ]
    return {"proposals": rows}, lines or ["nothing stands free in this room"]


def accepted(proposals: Sequence[Proposal], number: int) -> Separation:
    """The splats of one proposal, counted from 1.

    Raises:
        ValueError: there are not so many.
    """
    if not 1 <= number <= len(proposals):
        raise ValueError(f"--accept {number}: there are {len(proposals)} proposals, counted from 1")
    return proposals[number - 1].found


def id_of(name: str) -> str:
    """An id of letters, digits and hyphens made of a name."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:64] or "object"


def prompts_of(
    boxes: Sequence[Sequence[str]],
    clicks: Sequence[Sequence[str]],
    strokes_out: Sequence[Sequence[str]],
) -> dict[str, Prompt]:
    """Return the command line's marks by view, in the order of first mention.

    Raises:
        ValueError: a number is none, coordinates are odd in count, or a view has two boxes.
    """
    box_of: dict[str, tuple[float, float, float, float]] = {}
    for view, *numbers in boxes:
        if view in box_of:
            raise ValueError(f"--box: view {view!r} has two boxes; give one around the object")
        left, top, right, bottom = _numbers("--box", numbers)
        box_of[view] = (left, top, right, bottom)
    inside, outside = _points("--click", clicks), _points("--stroke-out", strokes_out)
    names = dict.fromkeys([*box_of, *inside, *outside])
    if not names:
        raise ValueError(
            "nexus cut: nothing is marked; give --box VIEW X0 Y0 X1 Y1 in 1 to 3 views"
        )
    none = np.zeros((0, 2))
    return {
        name: Prompt(box_of.get(name), inside.get(name, none), outside.get(name, none))
        for name in names
    }


def _points(flag: str, marks: Sequence[Sequence[str]]) -> dict[str, NDArray[np.float64]]:
    found: dict[str, list[float]] = {}
    for view, *numbers in marks:
        if not numbers or len(numbers) % 2:
            raise ValueError(f"{flag} {view}: {len(numbers)} numbers, wanted X Y of each point")
        found.setdefault(view, []).extend(_numbers(flag, numbers))
    return {view: np.array(values).reshape(-1, 2) for view, values in found.items()}


def _numbers(flag: str, words: Sequence[str]) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        raise ValueError(f"{flag}: {' '.join(words)!r} are not pixels; wanted numbers") from None


def prompted_views(
    package: ScenePackage, prompts: dict[str, Prompt], photos: Path | None
) -> list[PromptedView]:
    """The package's views that are marked, with their photos if a folder of them is given.

    Raises:
        ValueError: there is no such view, or its photo is missing or of another shape.
    """
    known: dict[str, ViewPoint] = {view.name: view for view in package.views}
    result = []
    for name, prompt in prompts.items():
        if name not in known:
            some = ", ".join(list(known)[:8]) or "none"
            raise ValueError(
                f"scene {package.name!r} has no view {name!r}; it has {len(known)}: {some}"
                f"{' …' if len(known) > 8 else ''}; 'nexus cut SCENE --views' lists them"
            )
        view = known[name]
        picture = None
        if photos is not None:
            picture, prompt = own_photo(view, photos / name, prompt)
        result.append(PromptedView(name, view.camera, view.world_from_camera, prompt, picture))
    return result


def write_previews(
    folder: Path, package: ScenePackage, views: Sequence[PromptedView], done: Cutout
) -> None:
    """A PNG per view: the picture that was marked, with the outline of what was found in it.

    Raises:
        WriteError: the folder is not writable.
    """
    renderer = NativeRenderer()
    last = done.package.cuts[-1]
    labels = np.zeros(len(package.room), dtype=bool)
    labels[last.places[last.is_object]] = True
    folder.mkdir(parents=True, exist_ok=True)
    for view in views:
        shown = share(package.room, labels, view.camera, view.world_from_camera, renderer=renderer)
        picture = view.picture
        if picture is None:
            picture = drawn_picture(package.room, view, renderer)
        canvas = picture.copy()
        found = (shown > 0.5).astype(np.uint8)
        canvas[found > 0] = canvas[found > 0] // 2 + np.array(OUTLINE_RGB, np.uint8) // 2
        contours, _ = cv2.findContours(found, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(canvas, contours, -1, OUTLINE_RGB, 1)
        _, png = cv2.imencode(".png", cv2.cvtColor(canvas, cv2.COLOR_RGB2BGR))
        write_file(folder / f"{Path(view.name).stem}.png", [png.tobytes()])
