"""`nexus study report DIR`: recordings and answers to tables with a codebook, and a page."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's folder")


def run(args: argparse.Namespace) -> int:
    """Write both.

    Raises:
        ValueError, OSError: a file is damaged, or cannot be read or written.
    """
    from scenes.opening import open_scene
    from studio.study.folder import StudyFolder
    from studio.study.results.report import write_study_report
    from studio.study.results.tables import tables_of, write_tables

    folder = StudyFolder(args.folder)
    done = {ended.task for ended in folder.ended()}
    scenes = {task.scene for task in folder.study.tasks if task.task_id in done}
    models = {name: open_scene(name).objects for name in sorted(scenes)}
    tables = tables_of(folder, models)
    for file in write_tables(folder, tables):
        print(file)
    print(write_study_report(folder, tables))
    left = len(folder.trials) - len(tables.trials)
    if left:
        print(f"{left} trials are left to do", file=sys.stderr)
    return 0
