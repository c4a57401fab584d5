"""`nexus study run DIR [PARTICIPANT]`: the live session of a participant's next task."""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from studio.verbs.sessions.live import setup_of

if TYPE_CHECKING:
    from studio.study.folder import Ended, StudyFolder
    from studio.study.order import Trial


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's folder")
    parser.add_argument(
        "participant", nargs="?", metavar="WHO", help="id of the plan (the first with a task left)"
    )
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--camera", metavar="ADDRESS", help="where pictures come from")
    source.add_argument("--devices", type=Path, metavar="FILE", help="devices as TOML")
    source.add_argument(
        "--simulated",
        action="store_true",
        help="a simulated camera, and simulated people of the task's scenario: a rehearsal",
    )
    parser.add_argument("--layout", default="auto", help="such as 'side_by_side 0 0' (auto)")
    parser.add_argument(
        "--place", choices=("find", "scan"), default="find", help="as of nexus live (find)"
    )
    parser.add_argument(
        "--port", type=int, default=0, metavar="N", help="at which people join (any free one)"
    )
    parser.add_argument(
        "--people-open", action="store_true", help="let the network reach them, over TLS"
    )
    parser.add_argument(
        "--limit",
        type=float,
        metavar="S",
        help="end the task after so long, whatever the study has",
    )


def run(args: argparse.Namespace) -> int:
    """Play it; exit 1 if no task was begun.

    Raises:
        ValueError, OSError: an input is bad, or a file cannot be written.
    """
    from devices.clock import WallClock
    from scenes.memory import share_one_heap
    from studio.live.people.hosting import Hosting
    from studio.study.folder import StudyFolder
    from studio.study.trial import Stage, play_trial

    if args.limit is not None and not args.limit > 0:
        raise ValueError(f"--limit {args.limit:g}: wanted more than 0")
    share_one_heap()
    folder = StudyFolder(args.folder)
    trial = _next(folder, args.participant)
    if trial is None:
        _say(f"nothing is left to do: nexus study report {args.folder}")
        return 0
    task = folder.study.task(trial.task)
    _say(f"{trial.name}: {task.title!r} in {task.scene}, condition {trial.condition!r}")
    stage = Stage(
        setup_of(args),
        Hosting(args.port, args.people_open, 0 if args.simulated else 1),
        WallClock(),
        is_rehearsed=args.simulated,
        limit_s=args.limit,
        say=_say,
    )
    signal.signal(signal.SIGINT, signal.default_int_handler)
    ended = play_trial(folder, trial, stage=stage)
    return _told(folder, trial, ended=ended)


def _next(folder: StudyFolder, participant: str | None) -> Trial | None:
    who = participant or folder.next_participant()
    return None if who is None else folder.next_trial(who)


def _told(folder: StudyFolder, trial: Trial, *, ended: Ended | None) -> int:
    """Say how it went; return the exit code."""
    if ended is None:
        _say(f"{trial.name}: no task was begun; it is still to be done")
        return 1
    _say(f"{trial.name}: {ended.ended_by} after {ended.duration_s:.1f} s")
    following = folder.next_trial(trial.participant)
    if following is None:
        _say(f"{trial.participant} has done everything")
    else:
        _say(f"next: nexus study run {folder.path} {trial.participant}")
    return 0


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
