"""Folders of a verb's results: never that of earlier ones unless asked to replace them."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_result_flags(parser: argparse.ArgumentParser, default: Path) -> None:
    """Add `--out` and `--replace`."""
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"results (default: {default}, or the next free one: {default}-2, …)",
    )
    parser.add_argument(
        "--replace", action="store_true", help="put them in the place of earlier ones in --out"
    )


def result_folder(args: argparse.Namespace, default: Path) -> Path:
    """The folder that results go to; nothing is made yet.

    Raises:
        ValueError: the one that was asked for holds something, and it may not be replaced.
    """
    from studio.session.records.outputs import check_target

    if args.out is None:
        return next_free(default)
    check_target(args.out)
    check_free(args.out, replaces=args.replace)
    return args.out


def check_free(folder: Path, *, replaces: bool) -> None:
    """Refuse a folder that holds earlier results, unless they may be replaced.

    Raises:
        ValueError: it does, and they may not.
    """
    if folder.is_dir() and any(folder.iterdir()) and not replaces:
        raise ValueError(
            f"{folder}: holds earlier results; choose another folder with --out, or --replace them"
        )


def next_free(default: Path) -> Path:
    """The folder of that name, or the next one that holds nothing, such as `NAME-2`."""
    number, folder = 1, default
    while folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        number += 1
        folder = default.with_name(f"{default.name}-{number}")
    return folder
