"""`nexus fork`: a recorded rehearsal goes on from an instant, as it was or with another scenario.

The simulation runs again from its start and proves, frame by frame, that it is the recorded one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.verbs.flags.results import add_result_flags, result_folder
from studio.verbs.sessions.playing import play_and_print

DEFAULT_OUT = Path("out/fork")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("recording", type=Path, help="recording.mcap of a rehearsal or a fork")
    parser.add_argument(
        "--at",
        type=float,
        required=True,
        metavar="SECONDS",
        help="the instant: the first frame at or after it is the first that can differ",
    )
    parser.add_argument(
        "--scenario",
        metavar="F",
        help="go on with this one, name or TOML file (default: unchanged)",
    )
    add_result_flags(parser, DEFAULT_OUT)
    parser.add_argument("--headless", action="store_true", help="without a window")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Fork; exit 1 if a figure misses its bar."""
    from studio.session.fork import open_fork
    from studio.session.plan import SessionPlan

    if args.out is not None and args.recording.resolve().parent == args.out.resolve():
        raise ValueError(f"{args.out}: holds the recording that is forked; choose another --out")
    out = result_folder(args, DEFAULT_OUT)
    fork = open_fork(args.recording, at_s=args.at, scenario=args.scenario)
    info = fork.info
    assert info.seed is not None
    plan = SessionPlan(scene=info.scene, seed=info.seed, methods=info.methods, fork=fork)
    return play_and_print(args, plan, out=out, verb="fork", doing="forking")
