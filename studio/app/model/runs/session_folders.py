"""The folders that sessions leave: one each, named by date and content, never one over another.

What is deleted goes to a folder beside them, from where it comes back until the studio is closed.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from studio.session.records.outputs import RECORDING, REPORT_HTML, REPORT_JSON

LIVE_JSON, LIVE_HTML = "live.json", "live.html"
"""Files that a live session leaves beside its recording, see `studio.live.report`."""

TRASH = ".deleted-"
"""Begins the name of the folder of what was deleted; the number of the studio's process ends it."""


def local_time() -> datetime:
    """Now, as clocks here show it."""
    return datetime.now(UTC).astimezone()


@dataclass(frozen=True, slots=True)
class KeptSession:
    """A session that was recorded.

    Attributes:
        folder: of all that it has left.
        recording: its file.
        begun: local time.
        title: room and scenario, or whatever else its folder is called.
        verdict: in words: how it went.
        is_good: whether every figure met its bar; None if there was nothing to judge.
        cut_short: when it was stopped, in words; empty if it was played to its end.
    """

    folder: Path
    recording: Path
    begun: datetime
    title: str
    verdict: str
    is_good: bool | None
    cut_short: str

    @property
    def report(self) -> Path | None:
        """Its page, if there is one."""
        for name in (REPORT_HTML, LIVE_HTML):
            if (self.folder / name).is_file():
                return self.folder / name
        return None


class SessionFolders:
    """Makes, lists and deletes them.

    Args:
        root: where they lie unless a project has a place of its own.
        now: local time.
    """

    def __init__(self, root: Path, now: Callable[[], datetime] = local_time) -> None:
        self.root = root
        self._now = now
        self._deleted: list[tuple[Path, Path]] = []
        """Each one's place before, and its place now; the last one deleted last."""

    def root_of(self, project: Path | None) -> Path:
        """Folder of a project's sessions: beside its file."""
        return self.root if project is None else project.with_name(f"{project.stem}-sessions")

    def reserve(self, project: Path | None, words: Iterable[str]) -> Path:
        """Make a folder for a session that begins now.

        Args:
            project: that it belongs to, or None.
            words: of its name, such as room and scenario.

        Raises:
            OSError: it cannot be made.
        """
        plain = [re.sub(r"[^\w.]+", "-", word).strip("-.") for word in words]
        stem = "_".join([self._now().strftime(NAME), *(word for word in plain if word)])
        return reserved(self.root_of(project) / stem)

    def listed(self, project: Path | None) -> list[KeptSession]:
        """Sessions of a project and beside it, newest first; what is damaged is left out."""
        found: dict[Path, KeptSession] = {}
        for root in dict.fromkeys((self.root_of(project), self.root)):
            self._put_back_orphans(root)
            for folder in sorted(root.iterdir()) if root.is_dir() else ():
                kept = None if folder.name.startswith(TRASH) else read_kept(folder)
                if kept is not None:
                    found[folder] = kept
        return sorted(found.values(), key=lambda kept: (kept.begun, kept.folder), reverse=True)

    @property
    def can_undo(self) -> bool:
        """Whether something was deleted that can come back."""
        return bool(self._deleted)

    def delete(self, folder: Path) -> None:
        """Delete a session, so that it can come back.

        Raises:
            ValueError: it is no session.
            OSError: it cannot be moved.
        """
        if read_kept(folder) is None:
            raise ValueError(f"{folder}: holds no recorded session; nothing was deleted")
        place = reserved(folder.parent / f"{TRASH}{os.getpid()}" / folder.name)
        place.rmdir()
        folder.rename(place)
        self._deleted.append((folder, place))

    def undo_delete(self) -> Path:
        """Bring back what was deleted last; gives its folder.

        Raises:
            ValueError: nothing was deleted.
            OSError: it cannot be moved.
        """
        if not self._deleted:
            raise ValueError("no session was deleted since the studio was opened")
        before, place = self._deleted[-1]
        back = _moved(place, before)
        self._deleted.pop()
        return back

    def close(self) -> None:
        """Remove for good what was deleted: the studio is closed."""
        for trash in {place.parent for _, place in self._deleted}:
            shutil.rmtree(trash, ignore_errors=True)
        self._deleted.clear()

    def _put_back_orphans(self, root: Path) -> None:
        """A studio that crashed has never been closed: what was deleted there comes back."""
        for trash in root.glob(f"{TRASH}*") if root.is_dir() else ():
            number = trash.name.removeprefix(TRASH)
            is_own = any(place.parent == trash for _, place in self._deleted)
            if is_own or not number.isdigit() or _is_running(int(number)):
                continue
            with contextlib.suppress(OSError):
                for folder in sorted(trash.iterdir()):
                    _moved(folder, root / folder.name)
                trash.rmdir()


NAME = "%Y-%m-%d_%H-%M-%S"
"""Begins the name of a session's folder: the names are in order of time."""


def reserved(wanted: Path) -> Path:
    """Make a folder of that name, or of the next that is free, such as `NAME-2`.

    Raises:
        OSError: it cannot be made.
    """
    wanted.parent.mkdir(parents=True, exist_ok=True)
    number = 1
    while True:
        path = wanted if number == 1 else wanted.with_name(f"{wanted.name}-{number}")
        try:
            path.mkdir()
        except FileExistsError:
            number += 1
        else:
            return path


def let_go(folder: Path) -> None:
    """Remove a reserved folder if nothing was left in it."""
    with contextlib.suppress(OSError):
        folder.rmdir()


def read_kept(folder: Path) -> KeptSession | None:
    """The session that a folder holds; None if it is no recorded session."""
    recording = _recording_in(folder)
    if recording is None:
        return None
    values = _report(folder)
    rows = values.get("rows", ())
    judged = [row.get("passed") for row in rows if isinstance(row, dict)]
    is_good = None if all(p is None for p in judged) else False not in judged
    cut_short = str(values.get("cut_short", ""))
    verdict = {True: "all figures keep their limits", False: "a figure misses its limit", None: ""}
    begun, title = _named(folder)
    return KeptSession(
        folder, recording, begun, title, verdict[is_good] if values else "", is_good, cut_short
    )


def _recording_in(folder: Path) -> Path | None:
    if not folder.is_dir():
        return None
    usual = folder / RECORDING
    return usual if usual.is_file() else next(iter(sorted(folder.glob("*.mcap"))), None)


def _report(folder: Path) -> dict[str, Any]:
    for name in (REPORT_JSON, LIVE_JSON):
        with contextlib.suppress(OSError, ValueError, TypeError):
            return dict(json.loads((folder / name).read_text(encoding="utf-8")))
    return {}


def _named(folder: Path) -> tuple[datetime, str]:
    """The begin and the title of a session, by the name of its folder."""
    day, time, words = (*folder.name.split("_", 2), "", "")[:3]
    try:
        begun = datetime.strptime(f"{day}_{time}", NAME).astimezone()
    except ValueError:
        return datetime.fromtimestamp(folder.stat().st_mtime, UTC).astimezone(), folder.name
    return begun, " · ".join(part for part in words.split("_") if part) or folder.name


def _moved(folder: Path, wanted: Path) -> Path:
    place = reserved(wanted)
    place.rmdir()
    folder.rename(place)
    return place


def _is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return pid != os.getpid()
