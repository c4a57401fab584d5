"""`nexus replay`: track a recording again; the same build gives the same tracks.

Only the shown tracker plays: the paper's method works on masks that a recording does not hold.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studio.console.rows import Row, as_json, as_table, at_least, at_most, exit_code
from studio.verbs.flags.results import check_free

if TYPE_CHECKING:
    from studio.session.session import SessionOutput


@dataclass(slots=True)
class Comparison:
    """New tracks against the recorded ones.

    Attributes:
        compared: poses that are in both.
        different: how many of them are not the same to the last bit, or differ in state.
        missing: recorded poses without a new one, or the other way round.
        largest_cm: largest distance between two that differ.
        first: where the first difference is, in words.
    """

    compared: int = 0
    different: int = 0
    missing: int = 0
    largest_cm: float = 0.0
    first: str = ""
    methods: set[str] = field(default_factory=set)

    def add(self, output: SessionOutput) -> None:
        """Compare one frame."""
        recorded = {
            (method, track.object_id): track
            for method, track in output.message.recorded
            if method in output.tracks
        }
        found = {
            (method, track.object_id): track
            for method, answer in output.tracks.items()
            for track in answer.objects
        }
        self.missing += len(recorded.keys() ^ found.keys())
        for key in sorted(recorded.keys() & found.keys()):
            self.compared += 1
            self.methods.add(key[0])
            old, new = recorded[key], found[key]
            same = old.state == new.state and np.array_equal(
                old.world_from_object.matrix(), new.world_from_object.matrix()
            )
            if same:
                continue
            self.different += 1
            apart = old.world_from_object.translation - new.world_from_object.translation
            self.largest_cm = max(self.largest_cm, 100 * float(np.linalg.norm(apart)))
            self.first = self.first or (
                f"{key[1]} ({key[0]}) at frame {new.source_seq}: "
                f"{old.state} then, {new.state} now, {100 * np.linalg.norm(apart):.3g} cm apart"
            )

    def in_words(self) -> str:
        """Return the outcome in one line."""
        if not self.compared and not self.missing:
            return (
                "nothing was compared: the recording holds no pictures with tracks; record a "
                "rehearsal, or give another recording"
            )
        if self.missing and not self.first:
            return f"{self.missing} tracks are in one of both only"
        return self.first or "the tracks are identical"

    def rows(self) -> list[Row]:
        """The figures of the comparison; any difference fails, and so does nothing compared."""
        return [
            at_least("replay.tracks.compared", self.compared, "", bar=1),
            at_most("replay.tracks.different", self.different, "", bar=0),
            at_most("replay.tracks.missing", self.missing, "", bar=0),
            Row("replay.tracks.apart_cm.max", self.largest_cm, "cm"),
        ]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("recording", type=Path, help="an MCAP recording, such as recording.mcap")
    parser.add_argument("--headless", action="store_true", help="without a window")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="also leave report, film and tracks"
    )
    parser.add_argument(
        "--replace", action="store_true", help="put them in the place of earlier ones in --out"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Replay; exit 1 if the tracks differ from the recorded ones."""
    from devices.recorded.index import is_whole
    from devices.recording import read_session
    from studio.console.display import why_no_window
    from studio.console.progress import text_progress
    from studio.rehearsal import perform
    from studio.session.opening import open_session
    from studio.session.plan import Pace, SessionPlan
    from studio.session.records.outputs import check_target

    info = read_session(args.recording)
    if info.mode == Pace.PACED:
        raise ValueError(
            f"{args.recording}: recorded in real time ({info.mode}): which frames the tracker "
            "missed depended on the machine, so its tracks cannot be reproduced"
        )
    plan = SessionPlan(scene=info.scene, recording=args.recording, methods=info.methods[:1])
    comparison = Comparison()
    progress = text_progress()
    rows: list[Row] = []
    if args.out is not None:
        check_target(args.out)
        check_free(args.out, replaces=args.replace)
        performance = perform(
            plan, args.out, progress=progress, watch=comparison.add, verb="replay"
        )
        rows = performance.rows
        print(f"report: {args.out / 'report.html'}", file=sys.stderr)
    elif not args.headless and why_no_window() is None:
        from studio.app.window import replay_in_window

        replay_in_window(plan, comparison.add)
    else:
        progress.begin("replaying")
        result = open_session(plan).run(comparison.add)
        progress.finish(f"{result.frames} frames")
    rows = comparison.rows() + rows
    if args.json:
        print(json.dumps(as_json("replay", rows, info.seed), indent=2))
    else:
        print(as_table(rows))
    if not is_whole(args.recording):
        print(
            f"nexus replay: {args.recording} was cut off; it was read to its last whole chunk",
            file=sys.stderr,
        )
    print(f"nexus replay: {comparison.in_words()}", file=sys.stderr)
    return exit_code(comparison.rows())
