"""Makes a scene fit to rehearse in: a splat file becomes a room, a scan gets its reality."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

PACKAGE_SUFFIX = ".gnx"


def add_unit_flags(parser: argparse.ArgumentParser) -> None:
    """Add flags for the facts that a splat file of elsewhere does not say."""
    parser.add_argument(
        "--metres-per-unit", type=float, metavar="N", help="of a splat file that SCENE names"
    )
    parser.add_argument(
        "--height", type=float, metavar="M", help="or metres from its floor to its ceiling"
    )
    parser.add_argument("--up", metavar="AXIS", help="which axis of it is up, such as -y")


def scene_to_rehearse(args: argparse.Namespace) -> str:
    """The scene that the verb's flags ask for, made fit to rehearse in.

    Args:
        args: of a verb with `scene`, `out`, `work` and the flags of `add_unit_flags`.

    Returns:
        What a session can open: the scene itself, or the package that was made of a splat file,
        beside the results.

    Raises:
        ValueError: what is missing cannot be made, or nobody says how long a file's unit is.
        OSError: the disk is full; a training goes on from there the next time.
    """
    from scenes.formats.sog import is_sog_folder
    from scenes.package import is_package
    from scenes.samples import SAMPLE_NAMES

    path = Path(args.scene)
    if args.scene in SAMPLE_NAMES or not path.exists():
        return str(args.scene)
    if path.is_dir() and is_package(path):
        add_reality(path, args.work)
        return str(args.scene)
    if path.is_file() or is_sog_folder(path):
        return _room_of_splats(path, args)
    return str(args.scene)


def add_reality(scene: Path, work_folder: Path | None, *, seed: int = 0) -> None:
    """Add a second reconstruction to a scene package that needs one and has none.

    Args:
        scene: a package's folder. Built-in rooms exist without a scan, and where nothing can be
            moved nothing is tracked: those stay as they are.
        work_folder: of its preparation; beside the package if not given.
        seed: of the training.

    Raises:
        ValueError: the work folder is not there or another room's; the scene is damaged.
        OSError: the disk is full; the training goes on from there the next time.
    """
    from scenes.package import load_package
    from scenes.prepare.foreign.foreign import no_movable_object
    from studio.console.progress import StageProgress, text_progress
    from studio.session import staging

    package = load_package(scene)
    if package.physical is not None or package.reality is not None:
        return
    if not package.objects:
        print(no_movable_object(str(scene)), file=sys.stderr)
        return
    print(
        f"{scene}: training its photos once more, once; the scan itself would show the tracker "
        "its own model",
        file=sys.stderr,
    )
    stages = StageProgress(text_progress())
    staging.add_reality(scene, work_folder, seed=seed, progress=stages)
    stages.finish()


def _room_of_splats(path: Path, args: argparse.Namespace) -> str:
    from scenes.package import is_package, save_package
    from scenes.prepare.foreign.foreign import Unit, foreign_scene, no_movable_object
    from scenes.prepare.foreign.level import AXES
    from scenes.render.native import NativeRenderer
    from studio.console.progress import text_progress

    if args.up is not None and args.up not in AXES:
        raise ValueError(f"--up {args.up}: wanted one of {', '.join(AXES)}")
    target = args.out.with_name(f"{path.name.split('.')[0]}{PACKAGE_SUFFIX}")
    if is_package(target):
        print(f"{target}: made of {path.name} before; delete it to make it anew", file=sys.stderr)
        return str(target)
    progress = text_progress()
    progress.begin(f"making a room of {path}")
    package = foreign_scene(
        path,
        unit=Unit(args.metres_per_unit, args.height),
        up=args.up,
        renderer=NativeRenderer(),
        progress=lambda done, note: progress.advance(done, note),
    )
    save_package(package, target)
    progress.finish("; ".join(stage.detail for stage in package.stages))
    print(no_movable_object(str(target)), file=sys.stderr)
    return str(target)
