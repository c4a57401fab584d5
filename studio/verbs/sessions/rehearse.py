"""`nexus rehearse`: the main job, from a scene's name to a report."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from studio.verbs.flags.results import add_result_flags, result_folder
from studio.verbs.sessions.playing import play_and_print

DEFAULT_OUT = Path("out/rehearsal")

DEFAULT_SWEEP_OUT = Path("out/sweep")

PACKAGE_SUFFIX = ".gnx"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "scene",
        nargs="?",
        default="lab",
        help="built-in room, scene package or splat file (default: lab)",
    )
    parser.add_argument("--scenario", metavar="F", help="name or TOML file (default: the room's)")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    add_result_flags(parser, DEFAULT_OUT)
    parser.add_argument("--headless", action="store_true", help="without a window")
    parser.add_argument(
        "--method",
        choices=("own", "paper", "both"),
        default="own",
        help="tracker to show and to hold to the bars; 'both' is own with the paper's beside it",
    )
    parser.add_argument(
        "--no-paper", action="store_true", help="leave out the paper's method on the same frames"
    )
    parser.add_argument(
        "--work",
        type=Path,
        metavar="DIR",
        help="of a scan's preparation, where what stands for the real room is trained the first "
        "time (SCENE.prepare)",
    )
    add_unit_flags(parser)
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument(
        "--exact", action="store_true", help="nothing dropped, the same every time (default)"
    )
    pace.add_argument(
        "--paced", action="store_true", help="in real time: frames are dropped when it is too slow"
    )
    parser.add_argument(
        "--sweep",
        metavar="F",
        help="name or TOML file: the same rehearsal with faults of each size",
    )
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="play the sweep on a Dask cluster (tcp://HOST:PORT)"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Rehearse; exit 1 if a figure misses its bar."""
    if args.sweep is not None:
        return run_sweep(args)
    if args.cluster is not None:
        raise ValueError("--cluster plays sweeps only: name one with --sweep")
    from studio.session.plan import Pace, SessionPlan

    out = args.out = result_folder(args, DEFAULT_OUT)
    plan = SessionPlan(
        scene=scene_to_rehearse(args),
        scenario=args.scenario,
        seed=args.seed,
        methods=methods(args.method, without_paper=args.no_paper),
        pace=Pace.PACED if args.paced else Pace.EXACT,
    )
    return play_and_print(args, plan, out=out, verb="rehearse", doing="rehearsing")


def run_sweep(args: argparse.Namespace) -> int:
    """Play a sweep and draw its page; runs that its folder holds already are not played again."""
    from functools import partial

    from scenes.samples import SAMPLE_NAMES
    from studio.console.progress import text_progress
    from studio.sweep.cluster import play_on_cluster
    from studio.sweep.local import play_here
    from studio.sweep.plan import load_sweep
    from studio.sweep.results import SWEEP_HTML
    from studio.sweep.sweep import sweep

    target = args.out = args.out or DEFAULT_SWEEP_OUT
    scene = scene_to_rehearse(args)
    scene = scene if scene in SAMPLE_NAMES else str(Path(scene).resolve())
    if args.scenario is not None or args.paced:
        flag = "--paced" if args.scenario is None else "--scenario"
        raise ValueError(f"{flag} does not go with --sweep: the sweep's file says what is played")
    plan = load_sweep(args.sweep, scene)
    on_cluster = args.cluster is not None
    play = partial(play_on_cluster, address=args.cluster) if on_cluster else play_here
    rows = sweep(plan, target, progress=text_progress(), play=play)
    if args.json:
        print(json.dumps({"verb": "rehearse --sweep", "rows": rows}, indent=2))
    print(f"sweep: {target / SWEEP_HTML}", file=sys.stderr)
    return 0


def methods(chosen: str, *, without_paper: bool) -> tuple[str, ...]:
    """The trackers to run, the shown one first."""
    if chosen == "paper" or without_paper:
        return ("paper",) if chosen == "paper" else ("own",)
    return ("own", "paper")


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
