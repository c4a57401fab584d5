"""`nexus study plan DIR`: who does what in which order, and forms on paper."""

from __future__ import annotations

import argparse
from pathlib import Path

PLAN = "plan.csv"
"""Name of the plan in a study's folder."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's folder")


def run(args: argparse.Namespace) -> int:
    """Write the plan and the forms, and say who is next.

    Raises:
        ValueError, OSError: the study's description is wrong, or a file cannot be written.
    """
    from scenes.formats.storage.atomic import write_file
    from studio.study.folder import StudyFolder
    from studio.study.printing import FORMS, order_rows, write_forms
    from studio.study.results.tables import as_csv

    folder = StudyFolder(args.folder)
    plan = args.folder / PLAN
    write_file(plan, [as_csv(order_rows(folder)).encode()])
    forms = write_forms(folder)
    print(f"{plan}: {len(folder.trials)} trials of {folder.study.participants} participants")
    print(f"{args.folder / FORMS}: {len(forms)} pages to print, consent first")
    participant = folder.next_participant()
    if participant is None:
        print(f"all trials have been done: nexus study report {args.folder}")
    else:
        print(f"next is {participant}: nexus study run {args.folder} {participant}")
    return 0
