"""Work in progress on the disk, so that a crash or a cut cable costs no more than a moment.

Every document of every process has a file of its own. Its name carries the process's number and
when that began; a file whose process is gone was left behind by a crash and is offered when the
studio opens.
"""

from __future__ import annotations

import contextlib
import os
import re
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from devices.streams import Slot
from scenes.formats.storage.atomic import write_whole
from scenes.workers.latest import Latest
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import (
    SUFFIX,
    DocumentError,
    document_to_text,
    load_document,
    project_of,
)

STEM = "autosave-"
BEGUN_NS = time.time_ns()
"""When this process began: the number alone may be that of one that is gone."""

CLOCKS_NS = 5_000_000_000
"""By so much a process's start and the clock may differ: one is counted in whole seconds."""

STARTED = 19
"""Place of a process's start among the words of `/proc/PID/stat` after its name."""

NAME = re.compile(rf"{STEM}(?P<pid>\d+)(?:-(?P<begun>\d+)-\d+)?")
"""Of a file, without its suffix: process, its begin, and which of its documents."""


@dataclass(frozen=True, slots=True, eq=False)
class Recovered:
    """A document that a crashed studio left behind.

    Attributes:
        document: as of its last change.
        path: the file.
        project: the document's own file; None if it was never saved.
        t_s: when it was written, seconds since 1970.
    """

    document: Document
    path: Path
    project: Path | None
    t_s: float


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    """A document to write; None where there is nothing to keep any more."""

    document: Document | None
    project: Path | None = None


class Autosave:
    """Writes the newest value of one document on a thread; older ones that it missed are skipped.

    Args:
        folder: where work in progress is kept.
        pid: of the process that it belongs to.
        number: which document of that process it is.
    """

    def __init__(self, folder: Path, *, pid: int | None = None, number: int = 0) -> None:
        self.path = folder / f"{STEM}{pid or os.getpid()}-{BEGUN_NS}-{number}{SUFFIX}"
        self._problem: Slot[str] = Slot()
        self._writer = Latest("autosave", self._write)

    def keep(self, document: Document, project: Path | None = None) -> None:
        """This is the work in progress now, and the file that it will be saved to."""
        self._writer.ask(_Kept(document, project))

    def forget(self) -> None:
        """Nothing is in progress: the document is saved as it is."""
        self._writer.ask(_Kept(None))

    def problem(self) -> str | None:
        """Why the last one could not be written, once; None if all is well."""
        return self._problem.take()

    def stop(self, *, keep: bool = False) -> None:
        """End; the file goes, unless it is to be kept."""
        self._writer.close(serves_last=True)
        if not keep:
            self.path.unlink(missing_ok=True)

    def _write(self, kept: _Kept, _stale: threading.Event) -> None:
        try:
            if kept.document is None:
                self.path.unlink(missing_ok=True)
            else:
                write_whole(
                    self.path,
                    document_to_text(kept.document, project=kept.project),
                    makes_folder=True,
                )
        except OSError as error:
            self._problem.put(
                f"work in progress cannot be kept: {self.path}: {error.strerror}; "
                "free some disk space, or save the project elsewhere"
            )


def recoverable(folder: Path) -> list[Recovered]:
    """Return what crashed studios left in a folder, newest first; damaged files stay untouched."""
    found: list[Recovered] = []
    for path in folder.glob(f"{STEM}*{SUFFIX}"):
        name = NAME.fullmatch(path.stem)
        if name is not None and not _is_at_work(int(name["pid"]), name["begun"]):
            with contextlib.suppress(DocumentError, OSError):
                document, project = load_document(path), project_of(path)
                found.append(Recovered(document, path, project, path.stat().st_mtime))
    return sorted(found, key=lambda item: -item.t_s)


def discard(recovered: Recovered) -> None:
    """The user does not want it, or has it open again."""
    recovered.path.unlink(missing_ok=True)


def _is_at_work(pid: int, begun: str | None) -> bool:
    """Whether the process that writes a file is there still, and not another one of its number."""
    if pid == os.getpid():
        return begun == str(BEGUN_NS)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    started_ns = _started_ns(pid)
    return begun is None or started_ns is None or started_ns <= int(begun) + CLOCKS_NS


def _started_ns(pid: int) -> int | None:
    """When a process started, nanoseconds since 1970; None where the system does not say."""
    try:
        # The second word is the program's name in brackets, which may hold spaces.
        words = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        system = Path("/proc/stat").read_text(encoding="utf-8")
        boot_s = int(re.findall(r"^btime (\d+)", system, re.MULTILINE)[0])
        since_boot_s = int(words[STARTED]) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return None
    return round(1e9 * (boot_s + since_boot_s))
