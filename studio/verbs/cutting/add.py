"""`nexus cut SCENE --add PHOTOS`: an object that was captured later becomes one of the room's."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.prepare.cutout.cutout import Cutout, cut_out
from scenes.prepare.cutout.marks.marks_in_the_middle import marks_in_the_middle
from scenes.prepare.cutout.marks.masks import GrabCutMasks, Masks, Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView, masked_views
from scenes.prepare.cutout.object.added import add_object, require_free_id
from scenes.prepare.cutout.object.free_place import free_place
from scenes.prepare.footage.capture import CaptureOptions
from scenes.prepare.options import PrepareOptions
from scenes.prepare.pipeline import Prepared, prepare
from scenes.prepare.reconstruction import read_picture
from scenes.prepare.stages import open_work_folder
from scenes.prepare.train.trainer import PRESETS
from scenes.render.native import NativeRenderer
from studio.console.progress import StageProgress, text_progress
from studio.verbs.flags.scale import add_scale_flags, known_length

MIN_PHOTOS, VIDEO_FRAMES = 4, 40
CAPTURED = "captured.gnx"
"""In the work folder: the object with what it stood on."""


@dataclass(frozen=True, slots=True, eq=False)
class Addition:
    """A room with an object more.

    Attributes:
        package: the room.
        captured: the object as it was photographed, with what it stood on.
        cutout: how it was cut out of that.
        prompted: the photos that it was marked in.
        where: in words, how its place was found.
    """

    package: ScenePackage
    captured: Prepared
    cutout: Cutout
    prompted: tuple[PromptedView, ...]
    where: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The flags of an object captured later."""
    group = parser.add_argument_group(
        "an object captured later",
        "4 to 40 photos from all around it, on a table or the floor, or on a turntable\n"
        "before a plain wall. A printed code beside it gives its size; one that hangs in\n"
        "the room, its place too. What all photos look at is marked, unless --box, --click\n"
        "or --stroke-out mark something in them, by the photos' names.",
    )
    group.add_argument(
        "--add", type=Path, metavar="PHOTOS", help="a folder of photos of the object, or a video"
    )
    add_scale_flags(group, without="Codes of the scene are known already")
    group.add_argument(
        "--at",
        type=_place,
        metavar="X,Y[,Z]",
        help="where it shall stand, metres; with a minus first: --at=-1,0.5 (default: where it was "
        "photographed if the scene's codes show it, else a free place on the floor)",
    )
    group.add_argument(
        "--yaw", type=float, metavar="DEG", help="how it is turned there, counter-clockwise"
    )
    group.add_argument(
        "--quality",
        choices=tuple(PRESETS),
        default="default",
        help="training steps, which two idle cores take in half a minute, two, eight",
    )
    group.add_argument("--steps", type=int, metavar="N", help="end the training after so many")
    group.add_argument(
        "--work",
        type=Path,
        metavar="DIR",
        help="where finished stages are kept, to go on there (default: SCENE.ID.prepare)",
    )
    # Contradictory flags are reported like any other wrong command line.
    parser.set_defaults(refuse=parser.error)


def add(
    args: argparse.Namespace,
    package: ScenePackage,
    *,
    object_id: str,
    prompts: Mapping[str, Prompt],
    masks: Masks | None,
) -> Addition:
    """Prepare the photos, cut the object out of them, and put it into the room.

    Args:
        args: the flags of `nexus cut`.
        package: the room; left as it is.
        object_id: of the object.
        prompts: marks in the photos, by their names; if there are none, the object in the middle is
            marked.
        masks: finds what the marks mean; GrabCut if not given.

    Raises:
        CaptureError: the photos cannot become an object; says what to do instead.
        ValueError: the id is taken, nothing gives the size, or there is no object to be found.
        OSError: the disk is full; finished stages are kept.
    """
    require_free_id(package, object_id)
    options = _options(args, package)
    renderer = NativeRenderer()
    captured = _prepared(args, object_id, options, renderer)
    marks = prompts or marks_in_the_middle(captured.package)
    prompted = tuple(_prompted(captured, marks))
    finder = masks or GrabCutMasks()
    masked = masked_views(captured.package.room, prompted, masks=finder, renderer=renderer)
    done = cut_out(
        captured.package,
        masked,
        object_id=object_id,
        name=args.name,
        kind=args.kind,
        renderer=renderer,
    )
    world_from_object, where = _placed(args, package, captured, done)
    changed = add_object(
        package,
        done.item,
        world_from_object,
        detail=f"{len(done.item.splats)} splats from {len(captured.sfm.placed)} photos, {where}",
    )
    return Addition(changed, captured, done, prompted, where)


def _options(args: argparse.Namespace, package: ScenePackage) -> PrepareOptions:
    """How the photos are prepared, or the end of the program where flags contradict themselves."""
    try:
        length = known_length(args.length, args.end or [])
        sides_m = args.qr_size if length else _sides(args.qr_size, package)
        return PrepareOptions(
            quality=args.quality,
            steps=args.steps,
            sides_m=sides_m,
            known_codes=package.codes if sides_m is not None else (),
            known_length=length,
            capture=CaptureOptions(frames=VIDEO_FRAMES, least_frames=MIN_PHOTOS),
            collision=False,
            keep_floaters=True,
        )
    except ValueError as error:
        refuse: NoReturn = args.refuse(str(error))
        return refuse


def _sides(
    given: Mapping[str, float] | float | None, package: ScenePackage
) -> Mapping[str, float] | float:
    """Sides of the codes in the photos, metres: those that are given, and the room's own.

    Raises:
        ValueError: there are none.
    """
    if isinstance(given, float | int):
        return given
    sides_m = {code.payload: code.side_m for code in package.codes}
    sides_m |= given or {}
    if not sides_m:
        raise ValueError(
            "nothing gives the size of the object: lay a printed code beside it and give "
            "--qr-size, or give --length with its two ends"
        )
    return sides_m


def _prepared(
    args: argparse.Namespace, object_id: str, options: PrepareOptions, renderer: NativeRenderer
) -> Prepared:
    stages = StageProgress(text_progress())
    work = open_work_folder(
        args.work or args.scene.with_name(f"{args.scene.name}.{object_id}.prepare"),
        seconds=time.monotonic,
        progress=stages,
    )
    captured = prepare(
        args.add, work.path / CAPTURED, work=work, options=options, renderer=renderer
    )
    stages.finish()
    return captured


def _prompted(captured: Prepared, prompts: Mapping[str, Prompt]) -> list[PromptedView]:
    """The marked photos.

    Raises:
        ValueError: no such photo found its place.
    """
    views = {view.name: view for view in captured.reconstruction.views}
    absent = [name for name in prompts if name not in views]
    if absent:
        raise ValueError(
            f"{absent[0]!r}: no photo of that name found its place; there are: {', '.join(views)}"
        )
    return [
        PromptedView(name, view.camera, view.world_from_camera, prompts[name], read_picture(view))
        for name, view in views.items()
        if name in prompts
    ]


def _placed(
    args: argparse.Namespace, package: ScenePackage, captured: Prepared, done: Cutout
) -> tuple[Pose, str]:
    """`world_from_object` in the room, and how it was found."""
    yaw = math.radians(args.yaw or 0.0)
    if args.at is not None:
        return Pose.from_yaw(yaw, args.at), "at the given place"
    # Codes whose places are known give the world; only without them gravity had to be found.
    if captured.alignment.gravity is None:
        there = done.item.world_from_object
        yaw = there.yaw() if args.yaw is None else yaw
        return Pose.from_yaw(yaw, there.translation), "where it was photographed"
    x, y = free_place(package, done.item.box_m)
    return Pose.from_yaw(yaw, (x, y, 0.0)), "at a free place on the floor"


def _place(text: str) -> tuple[float, float, float]:
    """`X,Y` on the floor, or `X,Y,Z`."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(math.isfinite(n) and abs(n) < 1e4 for n in numbers):
        raise argparse.ArgumentTypeError(f"{text!r}: wanted metres such as 1.2,0.5 or 1.2,0.5,0.74")
    x, y, z = (*numbers, 0.0)[:3]
    return x, y, z
