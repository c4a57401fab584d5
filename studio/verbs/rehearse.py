"""`nexus rehearse`: the main job, from a scene's name to a report."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from studio.verbs.rehearsable import add_unit_flags, scene_to_rehearse

DEFAULT_OUT = Path("out/rehearsal")
DEFAULT_SWEEP_OUT = Path("out/sweep")


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
    parser.add_argument(
        "--out", type=Path, default=DEFAULT_OUT, metavar="DIR", help=f"results ({DEFAULT_OUT})"
    )
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
    from studio.console.display import why_no_window
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code
    from studio.rehearsal import perform
    from studio.session.plan import Pace, SessionPlan
    from studio.session.records.outputs import check_target

    check_target(args.out)
    plan = SessionPlan(
        scene=scene_to_rehearse(args),
        scenario=args.scenario,
        seed=args.seed,
        methods=methods(args.method, without_paper=args.no_paper),
        pace=Pace.PACED if args.paced else Pace.EXACT,
    )
    no_window = "" if args.headless else why_no_window()
    if no_window is None:
        from studio.app.window import rehearse_in_window

        performance = rehearse_in_window(plan, args.out)
    else:
        if no_window:
            print(f"{no_window}: rehearsing without a window", file=sys.stderr)
        performance = perform(plan, args.out, progress=text_progress())
    if args.json:
        print(json.dumps(as_json("rehearse", performance.rows, args.seed), indent=2))
    else:
        print(as_table(performance.rows))
    print(f"report: {performance.folder / 'report.html'}", file=sys.stderr)
    return exit_code(performance.rows)


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

    target = DEFAULT_SWEEP_OUT if args.out == DEFAULT_OUT else args.out
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
