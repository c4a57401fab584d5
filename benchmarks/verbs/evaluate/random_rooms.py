"""`nexus evaluate random-rooms`: the tracker in rooms by seed, against exact truth."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.evaluate.random_rooms.tracking import Judged, TrackedRoom
    from studio.console.progress import Progress

JUDGED_SEEDS = "200-207"
"""Seeds that nothing is tuned on; 100-107 are for development."""

MAX_ROOMS = 100
"""Rooms in one run; each takes about a minute."""

HIGHEST_SEED = 1_000_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "--seeds", default=JUDGED_SEEDS, metavar="A-B",
        help=f"rooms from A to B, or one room ({JUDGED_SEEDS}, for judging; 100-107 to develop on)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="write all answers here")
    parser.add_argument(
        "--method", choices=("own", "paper"), default="own", help="tracker (default: own)"
    )
    parser.add_argument(
        "--pose-error-deg", type=float, default=0.5, help="of the camera's known pose (0.5)"
    )
    parser.add_argument("--pose-error-cm", type=float, default=1.0, help="likewise, in cm (1.0)")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Make the rooms, film, track, judge; exit 1 if a figure misses its bar.

    Raises:
        ValueError: the seeds or the pose error are out of range.
    """
    from benchmarks.evaluate.random_rooms.breakdown import breakdown
    from benchmarks.evaluate.random_rooms.scoring import room_rows
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code

    seeds = seeds_of(args.seeds)
    _check(args)
    progress = text_progress()
    rooms = [_tracked(seed, args, progress) for seed in seeds]
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        answers = args.out / f"answers-{args.method}.json"
        every = [_plain(judged) for room in rooms for judged in room.judged]
        answers.write_text(json.dumps(every), encoding="utf-8")
        print(f"answers: {answers}", file=sys.stderr)
    rows = room_rows(args.method, rooms)
    if args.json:
        values = as_json("evaluate random-rooms", rows)
        print(json.dumps({**values, "seeds": seeds, "method": args.method}, indent=2))
    else:
        caption = f"nexus evaluate random-rooms · {args.method} · seeds {args.seeds}"
        print("\n\n".join([caption, *breakdown(rooms), as_table(rows)]))
    return exit_code(rows)


def seeds_of(text: str) -> list[int]:
    """The seeds of "A-B" or "A".

    Raises:
        ValueError: it is neither, or there are too many.
    """
    found = re.fullmatch(r"(\d{1,7})(?:-(\d{1,7}))?", text.strip())
    if found is None:
        raise ValueError(f"--seeds {text!r}: wanted A-B, such as {JUDGED_SEEDS}, or one number")
    first, last = int(found[1]), int(found[2] or found[1])
    if last < first or last - first >= MAX_ROOMS or last > HIGHEST_SEED:
        raise ValueError(
            f"--seeds {text}: wanted A-B with A not above B, at most {MAX_ROOMS} rooms, and no "
            f"seed above {HIGHEST_SEED}"
        )
    return list(range(first, last + 1))


def _tracked(seed: int, args: argparse.Namespace, progress: Progress) -> TrackedRoom:
    """One room, from its seed to what the method reported of it."""
    from benchmarks.evaluate.filmed.takes import TakeCache
    from benchmarks.evaluate.random_rooms.filming import RoomFilm
    from benchmarks.evaluate.random_rooms.scanning import scan_of
    from benchmarks.evaluate.random_rooms.staging import staged
    from benchmarks.evaluate.random_rooms.tracking import CameraError, RoomTrial
    from benchmarks.random_rooms.room import random_room
    from studio.evaluate.perfect_detector import PerfectDetector
    from studio.session.trackers.methods import make_method

    progress.begin(f"room {seed}")
    room = random_room(seed)
    progress.finish(f"{len(room.movables)} objects, lenses of {room.lens_px} px")
    progress.begin(f"room {seed}: scan")
    scan = scan_of(room)
    progress.finish()
    progress.begin(f"room {seed}: pictures")
    play = staged(room)
    film = RoomFilm(room, play, cache=TakeCache(), advance=progress.advance)
    progress.finish(f"{len(play.stills)} stills, {len(play.sequence)} frames")
    detector = PerfectDetector() if args.method == "paper" else None
    method = make_method(args.method, scan, detector, stopwatch=time.perf_counter_ns)
    progress.begin(f"room {seed}: tracking with {args.method}")
    trial = RoomTrial(
        room,
        scan,
        method,
        camera_error=CameraError(args.pose_error_deg, args.pose_error_cm),
        stopwatch_ns=time.perf_counter_ns,
        shown=None if detector is None else detector.see_masks,
    )
    tracked = trial.run(film, play)
    progress.finish(f"{len(tracked.judged)} answers")
    return tracked


def _check(args: argparse.Namespace) -> None:
    limits = {
        "--pose-error-deg": (args.pose_error_deg, 0, 10),
        "--pose-error-cm": (args.pose_error_cm, 0, 50),
    }
    for flag, (value, low, high) in limits.items():
        if not low <= value <= high:
            raise ValueError(f"{flag} {value:g}: wanted {low:g} to {high:g}")


def _plain(judged: Judged) -> dict[str, Any]:
    answer = judged.answer
    state = None if answer.state is None else str(answer.state)
    return {
        "seed": judged.seed,
        "family": judged.family,
        "finish": judged.finish,
        **asdict(answer),
        "state": state,
    }
