"""A rehearsal or a fork played, in a window where there is one, and its figures printed."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from studio.session.plan import SessionPlan


def play_and_print(
    args: argparse.Namespace, plan: SessionPlan, *, out: Path, verb: str, doing: str
) -> int:
    """Play a plan and print its figures; return the exit code, 1 if one misses its bar.

    Args:
        args: with `headless` and `json`.
        plan: what is played.
        out: folder of its results.
        verb: written into the JSON.
        doing: verb as people read it where there is no window, such as "forking".
    """
    from studio.console.display import why_no_window
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code
    from studio.rehearsal import perform

    no_window = "" if args.headless else why_no_window()
    if no_window is None:
        from studio.app.window import rehearse_in_window

        performance = rehearse_in_window(plan, out)
    else:
        if no_window:
            print(f"{no_window}: {doing} without a window", file=sys.stderr)
        performance = perform(plan, out, progress=text_progress())
    if args.json:
        print(json.dumps(as_json(verb, performance.rows, plan.seed), indent=2))
    else:
        print(as_table(performance.rows))
    print(f"report: {performance.folder / 'report.html'}", file=sys.stderr)
    return exit_code(performance.rows)
