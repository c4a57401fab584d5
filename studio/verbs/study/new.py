"""`nexus study new DIR`: a study's folder with a description to edit."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's own folder")


def run(args: argparse.Namespace) -> int:
    """Make it.

    Raises:
        ValueError: there is a study already.
        OSError: the folder cannot be written into.
    """
    from scenes.formats.storage.atomic import write_file
    from studio.study.plan import FIRST_STUDY, STUDY_FILE, read_study

    file = args.folder / STUDY_FILE
    if file.exists():
        raise ValueError(f"{file}: is there already; edit it, or choose another folder")
    args.folder.mkdir(parents=True, exist_ok=True)
    write_file(file, [FIRST_STUDY.read_bytes()])
    study = read_study(args.folder)
    print(file)
    print(f"edit it, then: nexus study plan {args.folder}")
    print(f"it has {len(study.tasks)} tasks under {len(study.conditions)} conditions")
    return 0
