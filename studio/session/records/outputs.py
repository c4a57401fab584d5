"""The folder a verb leaves its results in: complete or absent, and never over someone's files."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from studio.session.pipeline import CancelledError

REPORT_HTML, REPORT_JSON = "report.html", "report.json"
TRACKS, FILM, RECORDING = "tracks.json", "rehearsal.mp4", "recording.mcap"
SCENARIO = "scenario.toml"
OUTPUT_NAMES = frozenset({REPORT_HTML, REPORT_JSON, TRACKS, FILM, RECORDING, SCENARIO})


@contextmanager
def output_folder(target: Path) -> Iterator[Path]:
    """A folder to fill, which becomes `target` when the block ends well.

    Until then it is called `TARGET.part-PROCESS` and stays so when something goes wrong, except for
    a cancelled session, which leaves nothing.

    Raises:
        ValueError: `target` holds files that are no results of ours.
        OSError: it cannot be made.
    """
    check_target(target)
    part = target.with_name(f"{target.name}.part-{os.getpid()}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    try:
        yield part
    except (CancelledError, KeyboardInterrupt, SystemExit):
        shutil.rmtree(part, ignore_errors=True)
        raise
    except BaseException:
        if not any(part.iterdir()):
            part.rmdir()
        raise
    _swap(part, target)


def check_target(target: Path) -> None:
    """Refuse a place that holds something else.

    Raises:
        ValueError: `target` is a file, or a folder with files that are no results of ours.
    """
    if not target.exists():
        return
    if not target.is_dir():
        raise ValueError(f"{target}: is a file; choose another folder with --out")
    foreign = sorted(entry.name for entry in target.iterdir() if entry.name not in OUTPUT_NAMES)
    if foreign:
        raise ValueError(
            f"{target}: holds {foreign[0]!r}, which no rehearsal wrote; "
            "choose an empty folder or an earlier rehearsal with --out"
        )


def _swap(part: Path, target: Path) -> None:
    old = target.with_name(f"{target.name}.old-{os.getpid()}")
    if target.exists():
        target.replace(old)
    part.replace(target)
    shutil.rmtree(old, ignore_errors=True)
